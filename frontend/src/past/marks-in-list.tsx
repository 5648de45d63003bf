/** What stands in the history between what people did: kept versions and runs. */
import { Link } from "wouter";
import type { HistoryEntry } from "../api/documents/history";
import { authorName } from "../api/graphs";
import type { ListedRun } from "../api/review";
import { useRunStatus } from "../status/run-status";
import { StateLabel } from "../status/state-label";
import { hourMinute, instant } from "../ui/times";
import style from "./history-panel.module.css";

const timeOf = (text: string | null): string => {
  const at = instant(text);
  return at === null ? "" : hourMinute(at);
};

interface VersionProps {
  entry: HistoryEntry;
  /** What the version is called: its label, or its number. */
  name: string;
  chosen: boolean;
  onChoose: () => void;
}

export function VersionRow({ entry, name, chosen, onChoose }: VersionProps) {
  return (
    <li className={style.mark} data-chosen={chosen || undefined}>
      <button type="button" aria-pressed={chosen} data-entry onClick={onChoose}>
        <span className={style.version}>{name}</span>
        <span>
          kept by <bdi>{authorName(entry.author)}</bdi>
        </span>
        <time dateTime={entry.until}>{timeOf(entry.until)}</time>
      </button>
    </li>
  );
}

export function RunRow({ run, version }: { run: ListedRun; version: string }) {
  const { tone, word } = useRunStatus(run);
  const at = run.started_at ?? run.requested_at;
  return (
    <li className={style.mark} data-run={run.number}>
      <Link to={`/runs/${run.id}`}>
        <StateLabel still tone={tone} word={`Run ${run.number}`} />
        <span>
          {version === "" ? "" : `${version} · `}
          {word}
        </span>
        <time dateTime={at}>{timeOf(at)}</time>
      </Link>
    </li>
  );
}
