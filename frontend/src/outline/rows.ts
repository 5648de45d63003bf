/** The graph as rows of an outline: actions, their outcomes, and what follows each. Pure. */
import type { PartOnCard } from "../canvas/editor-store";
import { relationId } from "../graph/document-keys";
import { type Note, notesOf } from "../graph/edit/notes";
import {
  type Action,
  ENTRY,
  EXIT,
  type Graph,
  type Key,
  PRECONDITIONS,
  type Precondition,
  type Relation,
  type Response,
} from "../graph/model";
import { shownName } from "../graph/questions";

interface OutlinePosition {
  readonly id: string;
  readonly level: number;
  /** The row above it in the tree; null at the top. */
  readonly parent: string | null;
  /** True if the rows under it are shown; null where there are none. */
  readonly open: boolean | null;
  /** From 1, among its siblings. */
  readonly at: number;
  readonly of: number;
}

export type OutlineItem = OutlinePosition &
  (
    | { readonly kind: "entry" }
    | { readonly kind: "action"; readonly action: Action; readonly follows: number }
    | { readonly kind: "outcome"; readonly action: Action; readonly outcome: Precondition }
    | {
        readonly kind: "target";
        readonly relation: Relation;
        readonly outcome: Precondition;
        readonly response: Response;
        /** All outcomes that say the same to the same action, where these are one row. */
        readonly bundled?: readonly Precondition[];
      }
    | { readonly kind: "note"; readonly note: Note }
    /** An action of a graph that is expanded in an action of this one. */
    | { readonly kind: "inside"; readonly part: PartOnCard }
  );

export type InsideRow = Extract<OutlineItem, { kind: "inside" }>;

type Children = ReadonlyMap<Key, readonly Relation[]>;

function childrenOf(graph: Graph): Children {
  const found = new Map<Key, Relation[]>();
  for (const relation of graph.relations) {
    const known = found.get(relation.parent);
    if (known) known.push(relation);
    else found.set(relation.parent, [relation]);
  }
  for (const list of found.values()) list.sort((a, b) => a.parentOrder - b.parentOrder);
  return found;
}

/** The actions in the order in which a run would come to them; unreachable ones last. */
export function inOrder(graph: Graph, children = childrenOf(graph)): Action[] {
  const actions = new Map(graph.actions.map((action) => [action.key, action]));
  const found = new Set<Key>();
  let front: Key[] = [ENTRY];
  while (front.length > 0) {
    const next: Key[] = [];
    for (const parent of front) {
      for (const { child } of children.get(parent) ?? []) {
        if (!actions.has(child) || found.has(child)) continue;
        found.add(child);
        next.push(child);
      }
    }
    front = next;
  }
  const rest = graph.actions.filter((action) => !found.has(action.key));
  return [...[...found].flatMap((key) => actions.get(key) ?? []), ...rest];
}

/** Returns the parts that are drawn on the card of an action. */
type PartsOf = (key: Key) => readonly PartOnCard[];

const nothing: PartsOf = () => [];

/**
 * Returns the rows of the outline of a graph. `isOpen` says of an action or outcome, by the id of its row, whether its
 * children are shown.
 */
export function rowsOf(
  graph: Graph,
  isOpen: (id: string) => boolean,
  partsOf: PartsOf = nothing,
): OutlineItem[] {
  const children = childrenOf(graph);
  const actions = inOrder(graph, children);
  const rows: OutlineItem[] = [];
  const notes = notesOf(graph);
  const of = 1 + actions.length + notes.length;
  const starts = children.get(ENTRY) ?? [];
  const entryOpen = starts.length === 0 ? null : isOpen(ENTRY);
  rows.push({ kind: "entry", id: ENTRY, level: 1, parent: null, open: entryOpen, at: 1, of });
  if (entryOpen) rows.push(...targets(starts, "on_true", ENTRY, 2));
  for (const [i, action] of actions.entries()) {
    const after = children.get(action.key) ?? [];
    const open = after.length === 0 ? null : isOpen(action.key);
    const follows = after.length;
    const place = { id: action.key, level: 1, parent: null, open, at: i + 2, of } as const;
    rows.push({ kind: "action", ...place, action, follows });
    if (open) rows.push(...outcomes(action, after, isOpen));
    rows.push(...insides(partsOf(action.key)));
  }
  for (const [i, note] of notes.entries()) {
    const at = actions.length + i + 2;
    rows.push({ kind: "note", id: note.key, level: 1, parent: null, open: null, at, of, note });
  }
  return rows;
}

/** The actions of all levels of an expanded graph, each below the one that stands for its graph. */
function insides(parts: readonly PartOnCard[]): InsideRow[] {
  const counts = new Map<string, number>();
  const around = ({ path }: PartOnCard) => path.slice(0, path.lastIndexOf("/"));
  const places = parts.map((part) => {
    const at = (counts.get(around(part)) ?? 0) + 1;
    counts.set(around(part), at);
    return at;
  });
  return parts.map((part, i) => ({
    kind: "inside",
    id: part.path,
    level: part.path.split("/").length,
    parent: around(part),
    open: null,
    at: places[i] ?? 1,
    of: counts.get(around(part)) ?? 1,
    part,
  }));
}

function outcomes(
  action: Action,
  after: readonly Relation[],
  isOpen: (id: string) => boolean,
): OutlineItem[] {
  const said = PRECONDITIONS.map((outcome) => ({
    outcome,
    answers: after.filter((relation) => relation.conditions[outcome] !== "ignore"),
  })).filter(({ answers }) => answers.length > 0);
  // An arrow that ignores everything is there all the same: under the outcome that comes first.
  const mute = after.filter((relation) =>
    PRECONDITIONS.every((outcome) => relation.conditions[outcome] === "ignore"),
  );
  if (mute.length > 0 && said.every(({ outcome }) => outcome !== "on_true")) {
    said.unshift({ outcome: "on_true", answers: [] });
  }
  return said.flatMap(({ outcome, answers }, i) => {
    const id = `${action.key}|${outcome}`;
    const shown = outcome === "on_true" ? [...answers, ...mute] : answers;
    const open = isOpen(id);
    const row: OutlineItem = {
      kind: "outcome",
      id,
      level: 2,
      parent: action.key,
      open,
      at: i + 1,
      of: said.length,
      action,
      outcome,
    };
    return open ? [row, ...targets(shown, outcome, id, 3)] : [row];
  });
}

function targets(
  relations: readonly Relation[],
  outcome: Precondition,
  parent: string,
  level: 2 | 3,
): OutlineItem[] {
  return relations.map((relation, i) => ({
    kind: "target",
    id: `${relationId(relation)}|${outcome}`,
    level,
    parent,
    open: null,
    at: i + 1,
    of: relations.length,
    relation,
    outcome,
    response: relation.conditions[outcome],
  }));
}

export type BundleRow = Extract<OutlineItem, { kind: "target" }>;

/**
 * Returns what follows each action, one row for each arrow and response: outcomes with the same response share a
 * row.
 */
export function bundlesOf(graph: Graph): ReadonlyMap<Key, readonly BundleRow[]> {
  const all = [...childrenOf(graph)];
  return new Map(all.map(([parent, after]) => [parent, bundled(parent, after)]));
}

function bundled(parent: Key, after: readonly Relation[]): BundleRow[] {
  const bundles = after.flatMap((relation) => {
    if (parent === ENTRY) return [{ relation, response: "run" as const, outcomes: [] }];
    const spoken = PRECONDITIONS.filter((outcome) => relation.conditions[outcome] !== "ignore");
    // An arrow that ignores everything can be found and changed all the same.
    if (spoken.length === 0) return [{ relation, response: "ignore" as const, outcomes: [] }];
    const responses = [...new Set(spoken.map((outcome) => relation.conditions[outcome]))];
    return responses.map((response) => ({
      relation,
      response,
      outcomes: spoken.filter((outcome) => relation.conditions[outcome] === response),
    }));
  });
  return bundles.map(({ relation, response, outcomes }, i) => ({
    kind: "target",
    id: `${relationId(relation)}|${response}`,
    level: 2,
    parent,
    open: null,
    at: i + 1,
    of: bundles.length,
    relation,
    outcome: outcomes[0] ?? "on_true",
    bundled: outcomes,
    response,
  }));
}

/** The ends of an action after which nothing happens; being stopped is meant to be one. */
export function leadingNowhere(bundles: readonly BundleRow[]): Precondition[] {
  const spoken = new Set(bundles.flatMap(({ bundled = [] }) => bundled));
  return (["on_true", "on_false", "on_error"] as const).filter((outcome) => !spoken.has(outcome));
}

/** Returns the names of all actions and of both ends, with a number only where the name is not enough. */
export function namesOf(graph: Graph): ReadonlyMap<Key, string> {
  const counts = new Map<string, number>();
  for (const { name } of graph.actions) counts.set(name, (counts.get(name) ?? 0) + 1);
  const names = graph.actions.map(({ key, name, instanceId }): [Key, string] => [
    key,
    (counts.get(name) ?? 0) > 1 ? `${shownName(name)} ${instanceId}` : shownName(name),
  ]);
  return new Map([[ENTRY, "Entry"], [EXIT, "Exit"], ...names]);
}

/** Returns the key or id that is selected in the graph when a row is selected. */
export function subjectOf(row: OutlineItem): string {
  switch (row.kind) {
    case "entry":
      return ENTRY;
    case "action":
    case "outcome":
      return row.action.key;
    case "target":
      return relationId(row.relation);
    case "note":
      return row.note.key;
    case "inside":
      return row.part.path;
  }
}
