/**
 * From single actions and relations to one graph: numbering, ghosts, orphans, order.
 *
 * The rules that look at several owners at once. All of them derive and none repairs, so that every
 * replica shows the same without anybody having to write.
 */

import { relationId } from "./document-keys";
import {
  type Action,
  EMPTY_GRAPH,
  ENTRY,
  EXIT,
  fullName,
  type Graph,
  type Key,
  type Relation,
} from "./model";
import { byText, isEqual } from "./values";

/** An action as its own keys describe it, with its place, before actions are numbered. */
export interface RawAction {
  readonly action: Action;
  readonly order: number;
}

/** A graph, and the values it was made of: what is made of the same again stays the same. */
export interface Assembly {
  readonly graph: Graph;
  readonly numbered: ReadonlyMap<Action, Action>;
  readonly redirected: ReadonlyMap<Relation, Relation>;
  /** The real action by ghost, for ghosts whose name a real action has taken. */
  readonly takenUp: ReadonlyMap<Key, Key>;
}

export const emptyAssembly = (): Assembly => ({
  graph: EMPTY_GRAPH,
  numbered: new Map(),
  redirected: new Map(),
  takenUp: new Map(),
});

export function assemble(
  before: Assembly,
  actions: ReadonlyMap<Key, RawAction>,
  relations: ReadonlyMap<string, Relation>,
  frame: Omit<Graph, "actions" | "relations">,
): Assembly {
  const inOrder = [...actions.values()].sort(
    (a, b) => a.order - b.order || byText(a.action.key, b.action.key),
  );
  const { list, numbered } = number(
    inOrder.map((raw) => raw.action),
    before.numbered,
  );
  const takenUp = ghostsTakenUp(list);
  const shown = list.filter((action) => !takenUp.has(action.key));
  const alive = new Set<Key>([ENTRY, EXIT, ...list.map((action) => action.key)]);
  const whole = [...relations.values()].filter(
    (relation) => alive.has(relation.parent) && alive.has(relation.child),
  );
  const { arrows, redirected } = redirect(whole, takenUp, before.redirected);
  const old = before.graph;
  const graph: Graph = {
    ...frame,
    notes: kept(old.notes, frame.notes),
    extra: kept(old.extra, frame.extra),
    entryPosition: kept(old.entryPosition, frame.entryPosition),
    exitPosition: kept(old.exitPosition, frame.exitPosition),
    actions: keptList(old.actions, shown),
    relations: keptList(old.relations, arrows.sort(byEnds)),
  };
  return { graph: shallowSame(old, graph) ? old : graph, numbered, redirected, takenUp };
}

/**
 * Gives every action that only names a number of its own: per name by (instance_id, key) the first
 * keeps it, the rest take the lowest free one. Twins and ghosts keep theirs.
 */
function number(
  actions: readonly Action[],
  before: ReadonlyMap<Action, Action>,
): { list: Action[]; numbered: Map<Action, Action> } {
  const numbers = new Map<Key, number>();
  for (const group of byName(actions).values()) {
    if (group.length > 1) share(group, numbers);
  }
  const numbered = new Map<Action, Action>();
  const list = actions.map((action) => {
    const instanceId = numbers.get(action.key) ?? action.instanceId;
    if (instanceId === action.instanceId) return action;
    const known = before.get(action);
    const fresh = known?.instanceId === instanceId ? known : { ...action, instanceId };
    numbered.set(action, fresh);
    return fresh;
  });
  return { list, numbered };
}

function byName(actions: readonly Action[]): Map<string, Action[]> {
  const groups = new Map<string, Action[]>();
  for (const action of actions) {
    const group = groups.get(action.name);
    if (group) group.push(action);
    else groups.set(action.name, [action]);
  }
  return groups;
}

function share(group: readonly Action[], numbers: Map<Key, number>): void {
  const fixed = (action: Action) => action.twin || action.missing;
  const free = group
    .filter((action) => !fixed(action))
    .sort((a, b) => a.instanceId - b.instanceId || byText(a.key, b.key));
  const taken = new Set<number>();
  const rest: Action[] = [];
  for (const action of free) {
    if (taken.has(action.instanceId)) rest.push(action);
    else taken.add(action.instanceId);
  }
  for (const action of group) if (fixed(action)) taken.add(action.instanceId);
  let next = 0;
  for (const action of rest) {
    while (taken.has(next)) next += 1;
    taken.add(next);
    numbers.set(action.key, next);
  }
}

/** Returns the ghosts whose full name a real action has, with that action. */
function ghostsTakenUp(actions: readonly Action[]): Map<Key, Key> {
  const ghosts = actions.filter((action) => action.missing);
  if (ghosts.length === 0) return new Map();
  const real = new Map<string, Key>();
  for (const action of actions) {
    const name = fullName(action);
    if (!action.missing && !real.has(name)) real.set(name, action.key);
  }
  const taken = new Map<Key, Key>();
  for (const ghost of ghosts) {
    const key = real.get(fullName(ghost));
    if (key !== undefined) taken.set(ghost.key, key);
  }
  return taken;
}

/** Redirects arrows of replaced ghosts to the real action; a pair that exists gets a further listing. */
function redirect(
  relations: readonly Relation[],
  takenUp: ReadonlyMap<Key, Key>,
  before: ReadonlyMap<Relation, Relation>,
): { arrows: Relation[]; redirected: Map<Relation, Relation> } {
  const redirected = new Map<Relation, Relation>();
  if (takenUp.size === 0) return { arrows: [...relations], redirected };
  const touches = (relation: Relation) =>
    takenUp.has(relation.parent) || takenUp.has(relation.child);
  const arrows = relations.filter((relation) => !touches(relation));
  const taken = new Set(arrows.map(relationId));
  for (const relation of relations.filter(touches).sort(byEnds)) {
    const parent = takenUp.get(relation.parent) ?? relation.parent;
    const child = takenUp.get(relation.child) ?? relation.child;
    let listing = relation.listing;
    if (taken.has(relationId({ parent, child, listing }))) {
      listing = 0;
      while (taken.has(relationId({ parent, child, listing }))) listing += 1;
    }
    taken.add(relationId({ parent, child, listing }));
    const fresh = { ...relation, parent, child, listing };
    const known = before.get(relation);
    const arrow = known && isEqual(known, fresh) ? known : fresh;
    redirected.set(relation, arrow);
    arrows.push(arrow);
  }
  return { arrows, redirected };
}

function byEnds(a: Relation, b: Relation): number {
  return byText(a.parent, b.parent) || byText(a.child, b.child) || a.listing - b.listing;
}

function kept<T>(old: T, fresh: T): T {
  return isEqual(old, fresh) ? old : fresh;
}

/** The old list when each element is the very same object. */
function keptList<T>(old: readonly T[], fresh: readonly T[]): readonly T[] {
  return old.length === fresh.length && old.every((item, i) => item === fresh[i]) ? old : fresh;
}

function shallowSame(a: Graph, b: Graph): boolean {
  return (Object.keys(a) as (keyof Graph)[]).every((key) => a[key] === b[key]);
}
