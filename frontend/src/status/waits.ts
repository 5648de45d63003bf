/** Says for which action of another robot an action waits now, by the arrows of the graph that runs. Pure. */
import type { Graph, Key } from "../graph/model";
import { robotActionWords } from "../graph/relation-words";
import { handOverOf, robotOf } from "../graph/robots";
import type { Progress, Tone } from "./progress";

/** The actions that one action waits for, and those of them that are another robot's. */
export interface Needs {
  readonly parents: readonly Key[];
  readonly others: readonly { readonly key: Key; readonly words: string }[];
}

const known = new WeakMap<object, ReadonlyMap<Key, Needs>>();

/** Return the actions that wait for another robot's, by key; empty unless the graph has several robots. */
export function needsIn(graph: Graph): ReadonlyMap<Key, Needs> {
  const before = known.get(graph);
  if (before) return before;
  const robots = robotOf(graph);
  const needs = new Map<Key, Needs>();
  for (const relation of robots.size > 0 ? graph.relations : []) {
    const { parent, child, required } = relation;
    if (!required || !robots.has(parent)) continue;
    const { parents, others } = needs.get(child) ?? NONE;
    const other = handOverOf(relation, robots) && {
      key: parent,
      words: robotActionWords(graph, parent),
    };
    needs.set(child, {
      parents: [...parents, parent],
      others: other === null ? others : [...others, other],
    });
  }
  for (const [key, { others }] of needs) if (others.length === 0) needs.delete(key);
  known.set(graph, needs);
  return needs;
}

const NONE: Needs = { parents: [], others: [] };
const ENDED: ReadonlySet<Tone | undefined> = new Set(["true", "false", "error", "stopped", "done"]);

/**
 * Return what an action that has not begun waits for: "waits for Carrier: DriveTo"; null if no other
 * robot's action is next. Next are those that run, and after one of the actions that it waits for
 * has ended those that have not begun either.
 */
export function waitWords(
  { parents, others }: Needs,
  toneOf: (key: Key) => Tone | undefined,
): string | null {
  const begun = parents.some((key) => ENDED.has(toneOf(key)));
  const [next, ...more] = others.filter(({ key }) => {
    const tone = toneOf(key);
    return tone === "run" || (begun && tone === "idle");
  });
  if (next === undefined) return null;
  return `waits for ${next.words}${more.length > 0 ? ` +${more.length}` : ""}`;
}

/** The word of an action that may begin yet; one of a run that is over did not run. */
const WAITS = "waits";

const waiting = new WeakMap<Progress, Progress>();

/** Return progress whose word says what is waited for; the identical object for the same words. */
export function waitingFor(progress: Progress, words: string | null): Progress {
  if (words === null || progress.tone !== "idle" || progress.word !== WAITS) return progress;
  const before = waiting.get(progress);
  if (before?.word === words) return before;
  const now = { ...progress, word: words };
  waiting.set(progress, now);
  return now;
}

/** Return the progress of a graph in which actions that wait for another robot say so. */
export function withWaits(
  graph: Graph | null,
  progress: ReadonlyMap<Key, Progress>,
): ReadonlyMap<Key, Progress> {
  const needs = graph === null ? null : needsIn(graph);
  if (needs === null || needs.size === 0 || progress.size === 0) return progress;
  const found = new Map(progress);
  for (const [key, need] of needs) {
    const own = progress.get(key);
    if (own)
      found.set(
        key,
        waitingFor(
          own,
          waitWords(need, (of) => progress.get(of)?.tone),
        ),
      );
  }
  return found;
}
