/** All moments of a graph as a line: sittings, versions and runs on it, and the moment that is shown. */
import type { CSSProperties, KeyboardEvent } from "react";
import type { Version } from "../api/graphs";
import { authorName, versionName } from "../api/graphs";
import { keyOf } from "../ui/keys";
import style from "./scrubber.module.css";
import { momentAt, type TimelineItem } from "./timeline";

interface ScrubberMark {
  readonly key: string;
  readonly at: number;
  readonly kind: "sitting" | "version" | "run";
  readonly words: string;
  /** Author of a sitting. */
  readonly author: string | null;
}

/** The marks of what is loaded; a run stands where it was started, as far as that is known, else where its
 * version is. */
export function marksOf(
  items: readonly TimelineItem[],
  versions: readonly Version[],
): ScrubberMark[] {
  const seqOf = new Map(versions.map(({ id, seq }) => [id, seq]));
  const entries = items.flatMap((item) => (item.kind === "entry" ? [item.entry] : []));
  return items.flatMap((item): ScrubberMark[] => {
    if (item.kind === "run") {
      const at = momentAt(entries, item.at) ?? seqOf.get(item.run.version ?? "");
      const words = `Run ${item.run.number}`;
      return at === undefined ? [] : [{ key: item.run.id, at, kind: "run", words, author: null }];
    }
    const { kind, author, seq, from_seq, version } = item.entry;
    if (kind === "published" && version) {
      const words = versionName(versions, version.id) || version.label || "version";
      return [{ key: `v ${version.id}`, at: version.seq, kind: "version", words, author: null }];
    }
    if (from_seq === undefined) return [];
    const words = authorName(author);
    return [{ key: `e ${author.id} ${seq}`, at: seq, kind: "sitting", words, author: author.id }];
  });
}

interface Props {
  at: number;
  /** The other end of what is compared. */
  other: number | null;
  newest: number;
  /** The moment in words. */
  words: string;
  marks: readonly ScrubberMark[];
  colorOf: (person: string) => string;
  onAt: (seq: number) => void;
  onStep: (by: 1 | -1) => void;
  onLeave: () => void;
}

const STEPS: ReadonlyMap<string, 1 | -1> = new Map([
  ["ArrowLeft", -1],
  ["ArrowDown", -1],
  ["ArrowRight", 1],
  ["ArrowUp", 1],
]);

export function Scrubber(props: Props) {
  const { at, other, newest, words, marks, colorOf, onAt, onStep, onLeave } = props;
  const span = Math.max(1, newest - 1);
  const place = (seq: number) => ({ "--at": (seq - 1) / span }) as CSSProperties;
  const [from, to] = [Math.min(at, other ?? at), Math.max(at, other ?? at)];
  const onKeyDown = (event: KeyboardEvent) => {
    const key = keyOf(event);
    const by = STEPS.get(key);
    if (by === undefined && key !== "Escape") return;
    event.preventDefault();
    event.stopPropagation();
    if (by === undefined) onLeave();
    else onStep(by);
  };
  return (
    <div className={style.scrubber}>
      <div className={style.line} aria-hidden>
        <span
          className={style.compared}
          style={{ ...place(from), "--to": (to - 1) / span } as CSSProperties}
        />
        {other !== null && <span className={style.other} style={place(other)} />}
        {marks.map(({ key, at: seq, kind, words: label, author }) => (
          <span
            key={key}
            className={style.mark}
            data-kind={kind}
            title={label}
            style={
              {
                ...place(seq),
                ...(author === null ? {} : { "--c": colorOf(author) }),
              } as CSSProperties
            }
          >
            {kind === "version" && <b>{label}</b>}
          </span>
        ))}
      </div>
      <input
        type="range"
        className={style.range}
        min={1}
        max={Math.max(newest, at)}
        value={at}
        aria-label="Moment of the past"
        aria-valuetext={words}
        onChange={(event) => onAt(event.currentTarget.valueAsNumber)}
        onKeyDown={onKeyDown}
      />
    </div>
  );
}
