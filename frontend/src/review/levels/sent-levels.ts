/** The graphs inside of a run as they were sent along with it, and the ways through them. Pure. */
import type { Run } from "../../api/runs";
import { fromUmrf } from "../../canvas/from-umrf";
import { type Level, levelsOf } from "../../canvas/level-path";
import { fullName, type Graph, type Key } from "../../graph/model";

export interface SentLevel {
  readonly graph: Graph;
  /** Of the graph that it is a version of. */
  readonly id: string | null;
}

/** A graph with those inside of it, by value. */
export interface SentLevels {
  readonly top: SentLevel;
  /** By the name of the actions that stand for it. */
  readonly inside: (name: string) => SentLevel | null;
}

/** What was sent is read when it is asked for, each graph once. */
export function sentLevels({ umrf, graph: id, subgraphs = [] }: Run): SentLevels {
  const sent = new Map(subgraphs.map((each) => [each.name, each]));
  const known = new Map<string, SentLevel>();
  const inside = (name: string) => {
    const before = known.get(name);
    const found = sent.get(name);
    if (before !== undefined || found === undefined) return before ?? null;
    const read = { graph: fromUmrf(found.umrf), id: found.graph };
    known.set(name, read);
    return read;
  };
  return { top: { graph: fromUmrf(umrf), id }, inside };
}

/** All graphs on a way, the outermost first; null where one of them was not sent along. */
export function graphsOn(sent: SentLevels, levels: readonly string[]): SentLevel[] | null {
  const found = [sent.top];
  for (const level of levels) {
    const action = found.at(-1)?.graph.actions.find((each) => fullName(each) === level);
    const inside = action === undefined ? null : sent.inside(action.name);
    if (inside === null) return null;
    found.push(inside);
  }
  return found;
}

/** The key of an action on its level. */
export function keyAt(graph: Graph | undefined, name: string): Key | null {
  return graph?.actions.find((each) => fullName(each) === name)?.key ?? null;
}

const NO_ID = "run"; // in addresses: of a graph that was sent by a program, and is none of the server's

/** The way for an address; as far as it can be told in one. */
export function addressed(sent: SentLevels, levels: readonly string[]): Level[] {
  const graphs = graphsOn(sent, levels) ?? [];
  return levels.flatMap((level, depth) => {
    const around = graphs[depth];
    const action = keyAt(around?.graph, level);
    return action === null ? [] : [{ graph: around?.id ?? NO_ID, action }];
  });
}

/** The levels that an address asks for, as far down as there are such. */
export function levelsAsked(sent: SentLevels, search: string): string[] {
  const levels: string[] = [];
  for (const { action: key } of levelsOf(search)) {
    const here = graphsOn(sent, levels)?.at(-1);
    const action = here?.graph.actions.find((each) => each.key === key);
    if (action === undefined || sent.inside(action.name) === null) break;
    levels.push(fullName(action));
  }
  return levels;
}
