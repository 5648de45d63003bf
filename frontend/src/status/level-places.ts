/** Assigns the facts of a run to its levels: an engine names actions of sub-graphs `OUTER__NAME__ID/ACTION`. Pure.
 * The runner places by the same rule (docs/decisions/073-a-run-by-its-levels.md). */
import type { Run } from "../api/runs";
import { spokenName } from "../graph/spoken-name";

/** Position of an action in the hierarchy of a run. */
export interface LevelPlace {
  /** The actions that it is inside of, outermost first, by their full names. */
  readonly levels: readonly string[];
  /** Its own full name there. */
  readonly name: string;
  /** False where its name fits nowhere; then it stands at the top. */
  readonly known: boolean;
}

/** Return the engine's name of the sub-graph that an action of `graph` stands for. */
function partOf(graph: string, action: string): string {
  const at = action.lastIndexOf("_");
  return `${graph}__${action.slice(0, Math.max(0, at))}__${action.slice(at + 1)}`;
}

/** Names by all that may be the graph in front of the action: both may have the mark inside. */
function byPart(graph: string, names: readonly string[]): Map<string, string[]> {
  const parts = new Map<string, string[]>();
  for (const name of names) {
    if (!name.startsWith(`${graph}__`)) continue;
    for (let at = name.indexOf("/", graph.length); at >= 0; at = name.indexOf("/", at + 1)) {
      const part = name.slice(0, at);
      const inside = parts.get(part);
      if (inside === undefined) parts.set(part, [name]);
      else inside.push(name);
    }
  }
  return parts;
}

/** The place of each of these names in a run of `graph`, whose own actions are `own`. Level by level from
 * the top, so that marks inside of names mean nothing; nothing is left out. */
export function placesIn(
  graph: string,
  own: ReadonlySet<string>,
  names: Iterable<string>,
): Map<string, LevelPlace> {
  const found = new Map<string, LevelPlace>();
  for (const name of names)
    found.set(name, { levels: [], name, known: own.has(name) || !name.includes("/") });
  const parts = byPart(
    graph,
    [...found].flatMap(([name, { known }]) => (known ? [] : [name])),
  );
  const open = [...found.values()].filter(({ known }) => known);
  for (const name of own) if (!found.has(name)) open.push({ levels: [], name, known: true });
  const around = new Map(open.map((place) => [place, graph]));
  for (const place of open) {
    const part = partOf(around.get(place) ?? graph, place.name);
    for (const name of parts.get(part) ?? []) {
      if (found.get(name)?.known) continue;
      const levels = [...place.levels, place.name];
      const inner = { levels, name: name.slice(part.length + 1), known: true };
      found.set(name, inner);
      around.set(inner, part);
      open.push(inner);
    }
    parts.delete(part);
  }
  return found;
}

interface PlacesOfGraph {
  readonly graph: string;
  readonly found: ReadonlyMap<string, LevelPlace>;
}
const lastPlaces = new WeakMap<object, PlacesOfGraph>();

/** Return the positions of all actions of a run; the same object again for the same actions. */
export function placesOf(run: Run): ReadonlyMap<string, LevelPlace> {
  const actions = run.actions ?? {};
  const before = lastPlaces.get(actions);
  if (before?.graph === run.graph_name) return before.found;
  const own = Object.entries(actions).flatMap(([name, { aid }]) => (aid === null ? [] : [name]));
  const found = placesIn(run.graph_name, new Set(own), Object.keys(actions));
  lastPlaces.set(actions, { graph: run.graph_name, found });
  return found;
}

/** Between the levels, as people read them. */
export const INTO = " › ";

/**
 * Return the name by which a run reports the last action of a way, each action inside of the one
 * before.
 */
export function factOf(graph: string, way: readonly string[]): string {
  const [last = "", ...above] = [...way].reverse();
  if (above.length === 0) return last;
  return `${above.reverse().reduce(partOf, graph)}/${last}`;
}

/** The way to an action, in words. */
export function wayWords({ levels, name }: Pick<LevelPlace, "levels" | "name">): string {
  return [...levels, name].map(spokenName).join(INTO);
}

/** An action of a run in words, with the actions that it is inside of: `Round__Fetch__0/Lift_1` is Fetch › Lift 1. */
export function actionWords(run: Run, name: string): string {
  const opened = run.actions?.[name]?.levels;
  if (opened) return wayWords({ levels: opened, name });
  return wayWords(placesOf(run).get(name) ?? { levels: [], name });
}

/** Return a text of the runner about a run with the actions of the run as people call them. */
export function spokenIn(run: Run, text: string): string {
  const opened = Object.values(run.actions ?? {}).flatMap(({ levels }) => levels ?? []);
  return text.replace(/[\w/]+_\d+\b/g, (word) =>
    run.actions?.[word] || opened.includes(word) ? actionWords(run, word) : word,
  );
}
