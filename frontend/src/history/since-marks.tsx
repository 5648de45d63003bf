/** Keeps marked on the canvas what changed since the last good run, while nobody is at work on it. */

import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import { authorName, useVersions } from "../api/graphs";
import { fetchDocument, useBlame } from "../api/history";
import { newestRun } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { listRuns, NO_FILTER } from "../api/review";
import type { SinceMarks as MarksSince, SinceMark, SinceSignProps } from "../canvas/editor-store";
import { CHANGE_SIGNS } from "../canvas/marks/change-marks";
import { type FieldChange, linesOf } from "../differences/difference-words";
import { useEditorContext } from "../edit-actions/editor-context";
import { mapsFrom, relationId } from "../graph/document-keys";
import { shortText } from "../graph/field-words";
import type { Action, Graph, Relation } from "../graph/model";
import { readGraph } from "../graph/read";
import { useRoom } from "../sync/use-room";
import { useKept } from "../ui/hooks";
import { whenIdle } from "../ui/lazy-part";
import { Tooltip } from "../ui/tooltip";
import { changedAction, changedRelation } from "./graph-difference";
import style from "./since-marks.module.css";
import { type GoodRun, goodRuns } from "./timeline";

const NEWEST = 10; // runs among which the last good one is sought
const QUIET = 900; // ms without an edit, after which marks follow
const IDLE_WITHIN = 1_000; // ms
const NONE: readonly never[] = [];

/** Runs that went well are few enough to be asked for alone, once one has ended. */
function useLastGood(id: string): GoodRun | null {
  const { runner, now } = useLive();
  const newest = newestRun(now, id);
  const ended = newest?.ended_at ?? "";
  const { data: runs = NONE } = useQuery({
    enabled: runner !== undefined,
    queryKey: ["runs", "of", id, "good", ended],
    queryFn: ({ signal }) => {
      const filter = { ...NO_FILTER, graph: id, state: "finished", failed: "false" };
      return listRuns(runner ?? "", filter, null, NEWEST, signal);
    },
    placeholderData: (before) => before,
  });
  const { data: versions = NONE } = useVersions(id, runs[0]?.version ?? null);
  return useMemo(() => goodRuns(runs, versions).at(-1) ?? null, [runs, versions]);
}

/** Calls `work` once nothing has happened for a while and the page has nothing else to do. */
function quietly(work: () => void): { soon(): void; stop(): void } {
  let timer: ReturnType<typeof setTimeout> | undefined;
  let callOff = () => {};
  const stop = () => {
    clearTimeout(timer);
    callOff();
  };
  const soon = () => {
    stop();
    timer = setTimeout(() => {
      callOff = whenIdle(work, IDLE_WITHIN);
    }, QUIET);
  };
  return { soon, stop };
}

function useMarks({ run, seq }: GoodRun): void {
  const {
    id,
    store: { sinceMarks },
  } = useEditorContext();
  const client = useQueryClient();
  const { source } = useRoom();
  useEffect(() => {
    let over = false;
    let end = () => {};
    const load = async () => {
      const document = await client.fetchQuery({
        queryKey: ["past", id, "document", seq],
        queryFn: ({ signal }) => fetchDocument(id, seq, signal),
        staleTime: Number.POSITIVE_INFINITY,
      });
      if (over) return;
      const marker = new SinceMarker(readGraph(mapsFrom(document)));
      const show = () => {
        const marks = marker.marks(source.graph());
        if (sinceMarks.now()?.marks === marks) return;
        sinceMarks.set({ graph: id, run, seq, marks, Sign: SinceSign });
      };
      const later = quietly(show);
      later.soon();
      const stop = source.subscribe(later.soon);
      end = () => {
        stop();
        later.stop();
      };
    };
    // Without that moment nothing is marked.
    load().catch(() => {});
    return () => {
      over = true;
      end();
      sinceMarks.set(null);
    };
  }, [client, id, run, seq, source, sinceMarks]);
}

function Marks(good: GoodRun) {
  useMarks(good);
  return null;
}

function MarksOfNow() {
  const { id } = useEditorContext();
  const good = useLastGood(id);
  return good === null ? null : <Marks {...good} />;
}

/**
 * Marks changes since the last good run, while the present graph is on screen and no dry-run goes
 * on.
 */
export function SinceMarks() {
  const { past, dryRun } = useEditorContext();
  const [on] = useSinceOn();
  return on && past === null && dryRun === null ? <MarksOfNow /> : null;
}

interface WordsProps {
  of: string;
  mark: SinceMark;
  since: MarksSince;
}

/** `Ada changed speed 0.4 → 0.9 since run 41, which went well`. Who that was is asked for only now. */
function SinceWords({ of, mark, since: { graph, run, seq } }: WordsProps) {
  const found = useBlame(graph, of);
  const set = (found.data ?? []).filter(
    (each) => each.seq > seq && (mark.change === "added" || mark.fields.includes(each.field)),
  );
  const names = [...new Set(set.map(({ author }) => authorName(author)))];
  const who = names.length > 2 ? `${names.length} people` : names.join(" and ") || "Somebody";
  const did = mark.change === "added" ? "added it" : `changed ${mark.words}`;
  return (
    <>
      <bdi>{who}</bdi> {did} since run {run}, which went well
    </>
  );
}

export function SinceSign({ of, on, mark, since }: SinceSignProps) {
  return (
    <Tooltip label={<SinceWords {...{ of, mark, since }} />} width={260}>
      <span className={style.sign} data-on={on} data-since={mark.change}>
        <span aria-hidden>{CHANGE_SIGNS[mark.change]}</span>
        <span className="visually-hidden">
          {mark.change} since run {since.run}
        </span>
      </span>
    </Tooltip>
  );
}

const MOST = 2; // fields that are told

const ADDED: SinceMark = { change: "added", words: "", fields: [] };

/** Return the key of a field as the history has it: there the name of an action has none. */
const fieldOf = ({ field }: FieldChange): string => (field === "name" ? "" : field);

const short = (text: string | null): string => (text ? shortText(text, 40) : "nothing");

function markOf(fields: readonly FieldChange[] | null): SinceMark | null {
  if (fields === null) return null;
  const lines = linesOf(fields);
  const told = lines
    .slice(0, MOST)
    .map(
      ({ name, before, after }) =>
        `${name.replace(/^input /, "")} ${short(before)} → ${short(after)}`,
    );
  const more = lines.length > MOST ? ` and ${lines.length - MOST} more` : "";
  return { change: "changed", words: told.join(", ") + more, fields: fields.map(fieldOf) };
}

export class SinceMarker {
  readonly #actions: ReadonlyMap<string, Action>;
  readonly #relations: ReadonlyMap<string, Relation>;
  /** Marks by the present action or relation, which stays the same object while it does not change. */
  readonly #known = new WeakMap<Action | Relation, SinceMark | null>();
  #last: ReadonlyMap<string, SinceMark> = new Map();

  constructor(before: Graph) {
    this.#actions = new Map(before.actions.map((each) => [each.key, each]));
    this.#relations = new Map(before.relations.map((each) => [relationId(each), each]));
  }

  /** Returns the marks by key of an action and id of a relation; the same map while no mark changes. */
  marks(now: Graph): ReadonlyMap<string, SinceMark> {
    const found = new Map<string, SinceMark>();
    for (const each of now.actions) {
      const mark = this.#mark(each, this.#actions.get(each.key), changedAction);
      if (mark !== null) found.set(each.key, mark);
    }
    for (const each of now.relations) {
      const id = relationId(each);
      const mark = this.#mark(each, this.#relations.get(id), changedRelation);
      if (mark !== null) found.set(id, mark);
    }
    const last = this.#last;
    const same = found.size === last.size && [...found].every(([key, m]) => last.get(key) === m);
    if (!same) this.#last = found;
    return this.#last;
  }

  #mark<T extends Action | Relation>(
    now: T,
    before: T | undefined,
    changed: (before: T, after: T) => FieldChange[] | null,
  ): SinceMark | null {
    const known = this.#known.get(now);
    if (known !== undefined) return known;
    const mark = before === undefined ? ADDED : markOf(changed(before, now));
    this.#known.set(now, mark);
    return mark;
  }
}

export function useSinceOn() {
  return useKept("aa.since-marks", true);
}
