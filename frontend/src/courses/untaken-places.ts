/** What no expected course takes, as marks for cards and arrows, and as rows in words. Pure. */
import type { CheckedCourses, OutcomeArrow } from "../api/documents/courses";
import type { UntakenPlaces } from "../canvas/card-highlights";
import { relationId } from "../graph/document-keys";
import type { Graph, Precondition } from "../graph/model";
import { endName } from "../graph/relation-words";
import { isolated } from "../words/isolated";

/** By relation, those that are listed twice alike: a course cannot tell them apart. */
export function untakenPlaces(graph: Graph, { coverage }: CheckedCourses): UntakenPlaces {
  const pairs = new Map<string, Precondition[]>();
  for (const { parent, child, outcome } of coverage.untaken) {
    const pair = `${parent}>${child}`;
    const known = pairs.get(pair);
    if (known) known.push(outcome);
    else pairs.set(pair, [outcome]);
  }
  const outcomes = new Map<string, readonly Precondition[]>();
  for (const relation of graph.relations) {
    const found = pairs.get(`${relation.parent}>${relation.child}`);
    if (found) outcomes.set(relationId(relation), found);
  }
  return { outcomes, actions: new Set(coverage.unvisited) };
}

/** `Dock_0 → Charge_0`. */
export function arrowWords(graph: Graph, { parent, child }: OutcomeArrow): string {
  return `${isolated(endName(graph, parent))} → ${isolated(endName(graph, child))}`;
}

/** Whether the arrow is on screen still: the answer may be older than the last edit. */
export function isThere(graph: Graph, { parent, child }: OutcomeArrow): boolean {
  return graph.relations.some((each) => each.parent === parent && each.child === child);
}
