/** Events of a run, in order, in sentences. */
import { Button, TextInput } from "@mantine/core";
import { IconDownload, IconRefresh } from "@tabler/icons-react";
import { useMemo, useState } from "react";
import { authorName } from "../api/graphs";
import { errorText } from "../api/http";
import { useCurrentName } from "../api/people";
import { exportUrl, type ReplayMark, useRawEvents } from "../api/review";
import type { RunNote } from "../api/run-notes";
import { type Run, runPlace } from "../api/runs";
import { placesOf, spokenIn, wayWords } from "../status/level-places";
import {
  howWords,
  runEndText,
  type Tone,
  visitBegin,
  visitDurationBound,
  visitEnd,
} from "../status/progress";
import { toneColor } from "../status/state-label";
import { clock, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import { isListed, LevelChoice, LevelWord, type LogLevel } from "./log-levels";
import { markText } from "./replay-controls";
import style from "./run-events.module.css";
import { NoteHere, noteText } from "./run-notes";

interface Happening {
  at: number;
  tone: Tone;
  name: string | null;
  /** The action as the run calls it. */
  fact: string | null;
  text: string;
  /** The level of a line of the engine's log. */
  level?: LogLevel;
  /**
   * Order among events of one moment: an inner action ends before its outer one, and begins after
   * it.
   */
  order?: number;
}

/** Seconds after the start. The clock of an engine may stand a little behind the runner's. */
function after(start: number, at: number): string {
  return `+${(Math.max(0, at - start) / 1000).toFixed(1)}`;
}

/** Marks that say what neither the visits nor the run's own fields say. */
const TOLD: ReadonlySet<string> = new Set([
  "run.stop_requested.v1",
  "run.pause_requested.v1",
  "run.resume_requested.v1",
  "run.modify_requested.v1",
  "run.modify_refused.v1",
  "run.proof.v1",
  "run.silent.v1",
  "run.answered.v1",
  "run.held.v1",
  "run.released.v1",
  "run.handed_over.v1",
  "run.breakpoints_set.v1",
  "run.question_asked.v1",
  "run.question_answered.v1",
  "run.question_closed.v1",
]);

/** Return all events of a run as lines, oldest first; none stands before the start of the run. */
export function eventLines(
  run: Run,
  version: string,
  marks: readonly ReplayMark[] = [],
  by: string = authorName(run.author),
  notes: readonly RunNote[] = [],
): Happening[] {
  const all: Happening[] = [];
  const start = instant(run.started_at);
  const places = placesOf(run);
  for (const [fact, action] of Object.entries(run.actions ?? {})) {
    const place = places.get(fact) ?? { levels: [], name: fact };
    const who = { name: wayWords(place), fact };
    const depth = place.levels.length;
    const where = action.robot ? ` on ${isolated(action.robot)}` : "";
    action.visits.forEach((visit, i) => {
      const from = visitBegin(visit);
      const until = visitEnd(visit);
      const number = action.older + i + 1;
      const often = action.at_least ? ", or more often" : "";
      const again = number > 1 ? `again (${number}.)${often}` : "";
      if (from !== null)
        all.push({
          at: from,
          tone: "run",
          ...who,
          text: `runs${where} ${again}`.trim(),
          order: depth,
        });
      if (until !== null) {
        const result = visit.result?.replace(/^on_/, "") ?? null;
        const tone = (result ?? "done") as Tone;
        const last = visitDurationBound(visit) === null ? until : instant(visit.not_after);
        const how = howWords(visit);
        const seen = how === "" ? "" : ` (${how})`;
        const since =
          last === until || start === null ? "" : ` (not before ${after(start, until)})`;
        const open = last === null ? "; its code may go on" : "";
        const at = last ?? Math.max(until, from ?? until);
        all.push({
          at,
          tone,
          ...who,
          text: (result ?? "finished") + seen + since + open,
          order: -depth,
        });
      }
    });
    for (const message of action.messages) {
      const at = instant(message.at);
      if (at === null) continue;
      all.push({ at, tone: "idle", ...who, text: `“${message.text}”`, order: -depth });
    }
  }
  for (const line of run.log ?? []) {
    const at = instant(line.at);
    if (at === null) continue;
    const { text, level = "" } = line;
    all.push({ at, tone: "idle", name: "engine", fact: null, text, level });
  }
  for (const mark of marks) {
    const at = instant(mark.at);
    if (at === null || !TOLD.has(mark.kind)) continue;
    all.push({ at, tone: "stopped", name: null, fact: null, text: markText(mark) });
  }
  for (const note of notes) {
    const at = instant(note.moment);
    if (at !== null) all.push({ at, tone: "run", name: null, fact: null, text: noteText(note) });
  }
  for (const alarm of run.alarms) {
    const at = instant(alarm.at);
    if (at !== null)
      all.push({ at, tone: "error", name: null, fact: null, text: spokenIn(run, alarm.text) });
  }
  const end = instant(run.ended_at);
  if (end !== null)
    all.push({
      at: end,
      tone: "idle",
      name: null,
      fact: null,
      text: `Run ${runEndText(run)}${run.detail ? `: ${spokenIn(run, run.detail)}` : ""}`,
      order: Number.MAX_VALUE,
    });
  all.sort((a, b) => a.at - b.at || (a.order ?? 0) - (b.order ?? 0));
  if (start === null) return all;
  const text = `${isolated(by)} started ${version}${placeWords(runPlace(run))}`;
  return [{ at: start, tone: "idle", name: null, fact: null, text }, ...all];
}

/** Return where a run was started, for the end of a sentence; a run that only asks people has no place. */
function placeWords(place: string): string {
  if (place === "") return ", which only asks people";
  return place === "simulator" ? " in the simulator" : ` on ${place}`;
}

interface Props {
  runner: string | undefined;
  run: Run;
  version: string;
  /** The action that is chosen, as the run calls it. */
  selected: string | null;
  onPick: (fact: string | null) => void;
  marks: readonly ReplayMark[];
  /** Notes that people wrote for moments of the run. */
  notes: readonly RunNote[];
  /** The moment at which the replay stands, ms; null at the end. */
  at: number | null;
  onSeek: (at: number) => void;
}

const SHOWN = 400;

function Line(
  props: { event: Happening; start: number; first: boolean } & Omit<
    Props,
    "runner" | "run" | "version" | "marks" | "notes"
  >,
) {
  const { event, start, first, selected, onPick, at, onSeek } = props;
  return (
    <li
      className={style.event}
      data-selected={(event.fact !== null && event.fact === selected) || undefined}
      data-later={(at !== null && event.at > at) || undefined}
    >
      <button
        type="button"
        className={style.time}
        onClick={() => onSeek(event.at)}
        title="Show this moment"
      >
        <time dateTime={new Date(event.at).toISOString()}>
          {first ? clock(event.at) : after(start, event.at)}
        </time>
      </button>
      <span>
        {event.name !== null && (
          <button type="button" className={style.name} onClick={() => onPick(event.fact)}>
            <bdi>{event.name}</bdi>
          </button>
        )}{" "}
        {event.level !== undefined && (
          <>
            <LevelWord level={event.level} />{" "}
          </>
        )}
        <span style={event.tone === "idle" ? {} : { color: toneColor[event.tone] }}>
          {event.text}
        </span>
      </span>
    </li>
  );
}

export function RunEvents(props: Props) {
  const { runner, run, version, marks, notes, selected } = props;
  const [search, setSearch] = useState("");
  const [least, setLeast] = useState<LogLevel>("debug");
  const start = instant(run.started_at) ?? 0;
  const by = useCurrentName(run.author);
  const all = useMemo(
    () => eventLines(run, version, marks, by, notes),
    [run, version, marks, by, notes],
  );
  const wanted = search.trim().toLowerCase();
  const found = all.filter(
    (event) =>
      isListed(event.level, least) &&
      (wanted === "" || `${event.name ?? ""} ${event.text}`.toLowerCase().includes(wanted)),
  );
  const shown = found.slice(-SHOWN);
  return (
    <>
      <div className={style.search}>
        <TextInput
          className="flex-1"
          size="xs"
          aria-label="Search events"
          placeholder="Search events"
          value={search}
          onChange={(event) => setSearch(event.currentTarget.value)}
        />
        {(run.log ?? []).length > 0 && <LevelChoice least={least} onLeast={setLeast} />}
        <NoteHere runner={runner} run={run} at={props.at} />
      </div>
      {found.length > shown.length && (
        <p className={style.more}>{found.length - shown.length} earlier ones are not listed.</p>
      )}
      {found.length === 0 && <p className={style.more}>Nothing of this was said or seen.</p>}
      <ol className="list-reset">
        {shown.map((event, i) => (
          <Line
            // biome-ignore lint/suspicious/noArrayIndexKey: the list is only ever appended to
            key={i}
            event={event}
            start={start}
            first={event === all[0]}
            selected={selected}
            onPick={props.onPick}
            at={props.at}
            onSeek={props.onSeek}
          />
        ))}
      </ol>
    </>
  );
}

interface Stored {
  seq: number;
  kind: string;
  body: unknown;
}

function stored(line: string): Stored | null {
  try {
    const event: unknown = JSON.parse(line);
    if (typeof event !== "object" || event === null) return null;
    if (!("seq" in event && "kind" in event)) return null;
    const body = "body" in event ? event.body : event;
    return { seq: Number(event.seq), kind: String(event.kind), body };
  } catch {
    return null;
  }
}

function Event({ line }: { line: string }) {
  const [open, setOpen] = useState(false);
  const event = stored(line);
  return (
    <details className={style.rawEventsEvent} onToggle={(each) => setOpen(each.currentTarget.open)}>
      <summary>
        <span className={style.seq}>{event?.seq ?? ""}</span> {event?.kind ?? line.slice(0, 60)}
      </summary>
      {open && <pre>{event === null ? line : JSON.stringify(event.body, null, 1)}</pre>}
    </details>
  );
}

const MOST = 300;

export function RawEvents({ runner, run }: { runner: string | undefined; run: Run }) {
  const found = useRawEvents(runner, run, MOST);
  return (
    <div className={style.raw}>
      <div className={style.buttons}>
        <Button
          size="compact-xs"
          variant="default"
          leftSection={<IconRefresh size={13} aria-hidden />}
          loading={found.isFetching}
          onClick={() => void found.refetch()}
        >
          Read again
        </Button>
        {runner !== undefined && (
          <Button
            size="compact-xs"
            variant="default"
            component="a"
            href={exportUrl(runner, run.id, "jsonl")}
            leftSection={<IconDownload size={13} aria-hidden />}
          >
            All as a file
          </Button>
        )}
      </div>
      {found.isError && <p role="alert">{errorText(found.error)}</p>}
      {found.data?.lines.map((line) => (
        <Event key={line} line={line} />
      ))}
      {found.data?.more && <p>These are the first {MOST}; the file has all of them.</p>}
    </div>
  );
}
