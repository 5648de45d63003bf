/** One version: its name, note, author and digest, its runs, and what can be done with it. */
import { ActionIcon, Button } from "@mantine/core";
import { IconCopy, IconCopyPlus, IconGitCompare, IconLink, IconRestore } from "@tabler/icons-react";
import { Link } from "wouter";
import { authorName } from "../../api/graphs";
import { useLive } from "../../api/live/use-live";
import type { ListedRun } from "../../api/review";
import { useRunStatus } from "../../status/run-status";
import { StateLabel } from "../../status/state-label";
import { Tooltip } from "../../ui/floating/tooltip";
import { day, hourMinute, instant } from "../../ui/times";
import { copied } from "../ways/use-copies";
import { InsideVersion } from "./inside-version";
import { type ListedVersion, resultCounts, runsWords, shortDigest } from "./version-facts";
import style from "./versions.module.css";

const NEWEST = 3; // runs that are named

const timeWords = (text: string | null, now: number): string => {
  const at = instant(text);
  return at === null ? "" : `${day(at, now)} ${hourMinute(at)}`;
};

function RunItem({ run, now }: { run: ListedRun; now: number }) {
  const { tone, word } = useRunStatus(run);
  const at = run.started_at ?? run.requested_at;
  return (
    <li>
      <Link to={`/runs/${run.id}`}>
        <StateLabel still tone={tone} word={`Run ${run.number}`} />
        <span>{word}</span>
        <time dateTime={at}>{timeWords(at, now)}</time>
      </Link>
    </li>
  );
}

function Runs({ runs, now }: { runs: readonly ListedRun[]; now: number }) {
  const { now: heard } = useLive();
  if (runs.length === 0) return <p className={style.quiet}>{runsWords(runs, heard)}</p>;
  return (
    <>
      {runs.length > 1 && (
        <p className={style.counts}>
          <span className="visually-hidden">{runsWords(runs, heard)}</span>
          <span aria-hidden>
            {runs.length} runs:{" "}
            {resultCounts(runs, heard).map(({ tone, word, count }) => (
              <StateLabel key={word} still tone={tone} word={`${count} ${word}`} />
            ))}
          </span>
        </p>
      )}
      <ul className={style.runs} aria-label="Newest runs">
        {runs.slice(0, NEWEST).map((run) => (
          <RunItem key={run.id} run={run} now={now} />
        ))}
      </ul>
    </>
  );
}

interface Props {
  listed: ListedVersion;
  now: number;
  chosen: boolean;
  /** It is what the graph is now: there is nothing to compare, and no way back. */
  isNow: boolean;
  link: string;
  mayEdit: boolean;
  busy: boolean;
  onChoose: () => void;
  onCompare: () => void;
  onCopy: () => void;
  onRestore: () => void;
}

function Ways(props: Props) {
  const { listed, isNow, mayEdit, busy, link, onCompare, onCopy, onRestore } = props;
  const button = { size: "compact-sm", variant: "default" } as const;
  return (
    <div className={style.ways}>
      {!isNow && (
        <Button
          {...button}
          leftSection={<IconGitCompare size={14} aria-hidden />}
          onClick={onCompare}
        >
          Compare with now
        </Button>
      )}
      <Button
        {...button}
        leftSection={<IconLink size={14} aria-hidden />}
        onClick={() => void copied(link, "The link")}
      >
        <span>
          <span className="visually-hidden">Copy </span>Link
        </span>
      </Button>
      {mayEdit && (
        <Button
          {...button}
          loading={busy}
          leftSection={<IconCopyPlus size={14} aria-hidden />}
          onClick={onCopy}
        >
          Copy {listed.number} as a new graph
        </Button>
      )}
      {mayEdit && !isNow && (
        <Button
          {...button}
          loading={busy}
          leftSection={<IconRestore size={14} aria-hidden />}
          onClick={onRestore}
        >
          Make it so again
        </Button>
      )}
    </div>
  );
}

export function VersionItem(props: Props) {
  const { listed, now, chosen, onChoose } = props;
  const { version, number, runs } = listed;
  const { label, note, digest, author, at } = version;
  return (
    <li className={style.version} data-chosen={chosen || undefined} data-version={number}>
      <button type="button" className={style.choose} aria-pressed={chosen} onClick={onChoose}>
        <b className={style.number}>{number}</b>
        {label !== "" && <bdi className={style.label}>{label}</bdi>}
      </button>
      {note && (
        <p className={style.note} dir="auto">
          {note}
        </p>
      )}
      <p className={style.facts}>
        <bdi>{authorName(author)}</bdi> · <time dateTime={at}>{timeWords(at, now)}</time> ·{" "}
        <code title={digest}>{shortDigest(digest)}</code>
        <Tooltip label="Copy the whole digest">
          <ActionIcon
            size="sm"
            variant="subtle"
            aria-label={`Copy the digest of ${number}`}
            onClick={() => void copied(digest, "The digest")}
          >
            <IconCopy size={13} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </p>
      <Runs runs={runs} now={now} />
      {chosen && <InsideVersion version={version} />}
      {chosen && <Ways {...props} />}
    </li>
  );
}
