/** One entry of the history: who, when and what in words, and the ways back once it is chosen. */
import { Button } from "@mantine/core";
import { IconArrowBackUp, IconNote, IconRestore } from "@tabler/icons-react";
import type { CSSProperties, ReactNode } from "react";
import { authorName } from "../api/graphs";
import type { HistoryEntry } from "../api/history";
import { initials } from "../ui/name-colors";
import { hourMinute, instant } from "../ui/times";
import { type EntryLine, type LinePart, shortened } from "./entry-words";
import style from "./history-panel.module.css";
import { isWayBack } from "./history-words";

const MOST = 6; // lines of an entry

const SIGNS: Readonly<Record<EntryLine["sign"], ReactNode>> = {
  added: "+",
  removed: "−",
  changed: "△",
  overwritten: "≠",
  looks: "·",
  said: <IconNote size={12} />,
};

function Part({ part }: { part: LinePart }) {
  if (part.kind === "name") return <b>{part.text}</b>;
  if (part.kind === "old") return <del>{part.text}</del>;
  return part.kind === "new" ? <b className={style.value}>{part.text}</b> : part.text;
}

function LineWords({ parts }: { parts: readonly LinePart[] }) {
  // biome-ignore lint/suspicious/noArrayIndexKey: a line is told anew as a whole
  return parts.map((part, i) => <Part key={i} part={part} />);
}

interface LinesProps {
  changes: NonNullable<HistoryEntry["changes"]>;
  most?: number;
}

export function ChangeLines({ changes, most = MOST }: LinesProps) {
  const { lines, more } = shortened(changes, most);
  return (
    <>
      {lines.map((line, i) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: lines are told anew as a whole
        <span key={i} className={style.line} data-sign={line.sign}>
          <i aria-hidden>{SIGNS[line.sign]}</i>
          <span>
            <LineWords parts={line.parts} />
          </span>
        </span>
      ))}
      {more > 0 && <span className={style.more}>and {more} more</span>}
    </>
  );
}

/** `14:28–14:31`, or one time where both are the same minute. */
function timeRange(entry: Pick<HistoryEntry, "at" | "until">): string {
  const [from, to] = [instant(entry.at), instant(entry.until)].map((at) =>
    at === null ? "" : hourMinute(at),
  );
  return from === to ? `${to}` : `${from}–${to}`;
}

interface Props {
  entry: HistoryEntry;
  color: string;
  chosen: boolean;
  /** Words for an entry that is no edit by hand, such as restoring a moment; null for edits. */
  did: string | null;
  /** The moment on screen: what leads there is no way back. */
  now: number;
  mayEdit: boolean;
  busy: boolean;
  onChoose: () => void;
  onRevert: () => void;
  onRestore: () => void;
}

/** Return whether an entry can be reverted alone. */
const mayRevert = ({ from_seq, changes }: HistoryEntry): boolean =>
  from_seq !== undefined && from_seq >= 2 && changes !== undefined;

function WaysBack({ entry, now, busy, onRevert, onRestore }: Props) {
  const at = timeRange(entry);
  return (
    <div className={`${style.ways} fingers`}>
      {mayRevert(entry) && (
        <Button
          size="compact-sm"
          variant="default"
          loading={busy}
          leftSection={<IconArrowBackUp size={14} aria-hidden />}
          onClick={onRevert}
        >
          <span>
            Undo what <bdi>{authorName(entry.author)}</bdi> did
          </span>
        </Button>
      )}
      {isWayBack(entry, now) && (
        <Button
          size="compact-sm"
          variant="default"
          loading={busy}
          leftSection={<IconRestore size={14} aria-hidden />}
          onClick={onRestore}
        >
          Restore<span className="visually-hidden"> the graph as at {at}</span>
        </Button>
      )}
    </div>
  );
}

export function EntryRow(props: Props) {
  const { entry, color, chosen, did, mayEdit, onChoose } = props;
  const who = authorName(entry.author);
  return (
    <li className={style.entry} data-chosen={chosen || undefined}>
      <button
        type="button"
        className={style.choose}
        aria-pressed={chosen}
        data-entry
        onClick={onChoose}
      >
        <span className={style.face} style={{ "--c": color } as CSSProperties} aria-hidden>
          {initials(who)}
        </span>
        <span className={style.told}>
          <span className={style.head}>
            <bdi className="weight-600">{who}</bdi>{" "}
            <time dateTime={entry.until}>{timeRange(entry)}</time>
          </span>
          {did !== null && <span className={style.did}>{did}</span>}
          {entry.changes && <ChangeLines changes={entry.changes} />}
        </span>
      </button>
      {chosen && mayEdit && <WaysBack {...props} />}
    </li>
  );
}
