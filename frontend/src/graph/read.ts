/**
 * From the document to a graph: total, and incremental.
 *
 * `readGraph` reads plain maps at once; `followGraph` keeps a graph in step with a Yjs document and
 * reads again only what changed, so that everything else keeps its identity. Both are one reader.
 */

import type * as Y from "yjs";
import { type Assembly, assemble, emptyAssembly, type RawAction } from "./assemble";
import {
  bundleOfKey,
  endsOf,
  isAid,
  type Maps,
  mapsOf,
  ROOTS,
  type Root,
  relationId,
  rootOf,
  splitKey,
  waypointsKey,
} from "./document-keys";
import {
  type Action,
  ENTRY,
  ENTRY_CONDITIONS,
  EXIT,
  type Extra,
  type Graph,
  type JsonText,
  type Key,
  type Parameter,
  PRECONDITIONS,
  type Precondition,
  RESPONSES,
  type Relation,
  type Remap,
  type Response,
} from "./model";
import {
  asDirection,
  asInstanceId,
  asJsonText,
  asNumber,
  asPosition,
  asResponse,
  asText,
  asTextList,
  byText,
  isEqual,
} from "./values";

/** The fields of one owner, by the part of the key after its first `|`. */
type OwnerFields = ReadonlyMap<string, unknown>;

/** Reads one document state. Never throws. */
export function readGraph(maps: Maps): Graph {
  return new Reader(maps).graph();
}

/** A graph that is updated key by key, from any source of keys. */
export interface SteppedGraph {
  /** `undefined`: there is nothing under this key. */
  set(root: Root, key: string, value: unknown): void;
  /** Returns the graph; parts that did not change since the last call keep their identity. */
  graph(): Graph;
}

export function stepGraph(maps: Maps): SteppedGraph {
  return new Reader(maps);
}

/** Returns the ghosts that real actions replaced, and the ids under which their arrows are shown since. */
export function readTakenUp(maps: Maps): {
  readonly ghosts: readonly Key[];
  readonly arrows: readonly (readonly [from: string, to: string])[];
} {
  const { takenUp, redirected } = new Reader(maps).assembled();
  return {
    ghosts: [...takenUp.keys()],
    arrows: [...redirected].map(([raw, shown]) => [relationId(raw), relationId(shown)] as const),
  };
}

/** A graph that follows a document. `subscribe` and `graph` fit `useSyncExternalStore`. */
export interface GraphSource {
  /** Returns the present graph: the same object until a part of it changes. */
  graph(): Graph;
  /** Calls back after a transaction that may have changed it: at once if it is of this page, `own`. */
  subscribe(listener: (own: boolean) => void): () => void;
  /** Stops following the document. */
  close(): void;
}

/** Follows the graph of a document. `soon` calls back for changes of others, once for several transactions if it likes. */
export function followGraph(
  doc: Y.Doc,
  soon: (tell: () => void) => void = (tell) => tell(),
): GraphSource {
  const reader = new Reader(mapsOf(doc));
  const listeners = new Set<(own: boolean) => void>();
  let changed = false;
  const stops = ROOTS.map((root) => {
    const map = rootOf(doc, root);
    const onChange = (event: Y.YMapEvent<unknown>) => {
      for (const key of event.keysChanged as Set<string>) {
        reader.set(root, key, map.has(key) ? map.get(key) : undefined);
      }
      changed = true;
    };
    map.observe(onChange);
    return () => map.unobserve(onChange);
  });
  const tell = (own: boolean) => {
    for (const listener of [...listeners]) listener(own);
  };
  const tellOthers = () => tell(false);
  const onEnd = ({ local }: Y.Transaction) => {
    if (!changed) return;
    changed = false;
    if (local) tell(true);
    else soon(tellOthers);
  };
  doc.on("afterTransaction", onEnd);
  return {
    graph: () => reader.graph(),
    subscribe(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    close() {
      doc.off("afterTransaction", onEnd);
      for (const stop of stops) stop();
      listeners.clear();
    },
  };
}

class Reader {
  private readonly actionFields = new Map<Key, Map<string, unknown>>();
  private readonly relationFields = new Map<string, Map<string, unknown>>();
  private readonly positions: Map<string, unknown>;
  private readonly meta: Map<string, unknown>;
  private readonly actions = new Map<Key, RawAction>();
  private readonly relations = new Map<string, Relation>();
  private readonly staleActions = new Set<Key>();
  private readonly staleRelations = new Set<string>();
  private stale = true;
  private assembly = emptyAssembly();

  constructor(maps: Maps) {
    this.positions = new Map(maps.positions);
    this.meta = new Map(maps.meta);
    for (const [key, value] of maps.actions) this.set("actions", key, value);
    for (const [key, value] of maps.relations) this.set("relations", key, value);
  }

  set(root: Root, key: string, value: unknown): void {
    const { head, rest } = splitKey(key);
    switch (root) {
      case "meta":
        put(this.meta, key, value);
        break;
      case "positions":
        put(this.positions, key, value);
        this.staleActions.add(key);
        this.staleRelations.add(splitKey(bundleOfKey(key) ?? "").head);
        break;
      case "actions":
        if (!isAid(head)) return;
        put(owner(this.actionFields, head), key === head ? "" : rest || "|", value);
        this.staleActions.add(head);
        break;
      case "relations":
        if (endsOf(head) === null) return;
        put(owner(this.relationFields, head), rest, value);
        this.staleRelations.add(head);
        break;
      case "comments":
        return;
    }
    this.stale = true;
  }

  graph(): Graph {
    return this.assembled().graph;
  }

  assembled(): Assembly {
    if (!this.stale) return this.assembly;
    for (const key of this.staleActions) {
      const fields = this.actionFields.get(key);
      const fresh = fields && readAction(key, fields, this.positions.get(key));
      replace(this.actions, key, fresh ?? null);
      if (fields?.size === 0) this.actionFields.delete(key);
    }
    for (const id of this.staleRelations) {
      const fields = this.relationFields.get(id);
      replace(this.relations, id, (fields && readRelation(id, fields, this.positions)) ?? null);
      if (fields?.size === 0) this.relationFields.delete(id);
    }
    this.staleActions.clear();
    this.staleRelations.clear();
    this.assembly = assemble(this.assembly, this.actions, this.relations, this.frame());
    this.stale = false;
    return this.assembly;
  }

  /** Reads the fields of the graph itself. */
  private frame(): Omit<Graph, "actions" | "relations"> {
    return {
      name: asText(this.meta.get("name")) ?? "",
      description: asText(this.meta.get("description")) ?? "",
      entryPosition: asPosition(this.positions.get(ENTRY)) ?? null,
      exitPosition: asPosition(this.positions.get(EXIT)) ?? null,
      direction: asDirection(this.meta.get("direction")),
      notes: under(this.positions, "g/"),
      extra: extraOf(this.meta, "x"),
    };
  }
}

function put(map: Map<string, unknown>, key: string, value: unknown): void {
  if (value === undefined) map.delete(key);
  else map.set(key, value);
}

function owner(owners: Map<string, Map<string, unknown>>, key: string): Map<string, unknown> {
  const known = owners.get(key);
  if (known) return known;
  const fresh = new Map<string, unknown>();
  owners.set(key, fresh);
  return fresh;
}

/** Puts a freshly read value in the place of the old one, which stays when it says the same. */
function replace<T>(map: Map<string, T>, key: string, fresh: T | null): void {
  if (fresh === null) map.delete(key);
  else if (!isEqual(map.get(key), fresh)) map.set(key, fresh);
}

/** The JSON texts under a prefix, by name. */
function under(fields: OwnerFields, prefix: string): Extra {
  const found: [string, JsonText][] = [];
  for (const [key, value] of fields) {
    if (!key.startsWith(prefix)) continue;
    const text = asJsonText(value);
    if (text !== undefined) found.push([key.slice(prefix.length), text]);
  }
  return found.sort((a, b) => byText(a[0], b[0]));
}

/** Unknown fields in the order of their list, the others after them by name. */
function extraOf(fields: OwnerFields, head: string): Extra {
  const texts = new Map(under(fields, `${head}/`));
  return listed(texts.keys(), fields.get(head)).map((name) => [name, texts.get(name) ?? ""]);
}

function readAction(key: Key, fields: OwnerFields, position: unknown): RawAction | null {
  const name = asText(fields.get(""));
  if (name === undefined) return null;
  const action: Action = {
    key,
    name,
    instanceId: asInstanceId(fields.get("instance_id")) ?? 0,
    type: asText(fields.get("type")) ?? "sync",
    actor: asText(fields.get("actor")) ?? "",
    description: asText(fields.get("description")) ?? "",
    inputs: readParameters(fields, "in"),
    outputs: readParameters(fields, "out"),
    position: asPosition(position) ?? null,
    missing: fields.get("missing") === true,
    twin: fields.get("twin") === true,
    extra: extraOf(fields, "x"),
    ...breakpointOf(fields),
    ...asksOf(fields),
  };
  return { action, order: asNumber(fields.get("order")) ?? 0 };
}

function readParameters(fields: OwnerFields, side: "in" | "out"): readonly Parameter[] {
  const texts = new Map(under(fields, `${side}/`));
  return listed(texts.keys(), fields.get(side)).map((path) => ({
    path,
    text: texts.get(path) ?? "",
  }));
}

/** Names in the order of a list, the others after them as they come. */
function listed(names: Iterable<string>, order: unknown): readonly string[] {
  const known = new Set(names);
  const first = (asTextList(order) ?? []).filter((name) => known.has(name));
  return [...new Set([...first, ...known])];
}

function readRelation(id: string, fields: OwnerFields, positions: OwnerFields): Relation | null {
  const ends = endsOf(id);
  if (ends === null) return null;
  const answers = new Map<Precondition, Response>();
  for (const outcome of PRECONDITIONS) {
    const response = asResponse(fields.get(outcome));
    if (response !== undefined) answers.set(outcome, response);
  }
  if (ends.parent === ENTRY ? answers.get("on_true") !== "run" : answers.size === 0) return null;
  const answer = (outcome: Precondition) => answers.get(outcome) ?? "ignore";
  const only = fields.get("only");
  return {
    ...ends,
    conditions:
      ends.parent === ENTRY
        ? ENTRY_CONDITIONS
        : {
            on_true: answer("on_true"),
            on_false: answer("on_false"),
            on_error: answer("on_error"),
            on_stopped: answer("on_stopped"),
          },
    required: fields.get("required") !== false,
    remap: readRemaps(fields),
    only: only === "parents" || only === "children" ? only : null,
    parentOrder: asNumber(fields.get("po")) ?? 0,
    childOrder: asNumber(fields.get("co")) ?? 0,
    parentsExtra: extraOf(fields, "x/parents"),
    childrenExtra: extraOf(fields, "x/children"),
    waypoints: readWaypoints(id, positions),
    ...breakpointOf(fields),
  };
}

function breakpointOf(fields: OwnerFields): Pick<Action, "breakpoint"> {
  const text = asJsonText(fields.get("breakpoint"));
  return text === undefined ? {} : { breakpoint: text };
}

function asksOf(fields: OwnerFields): Pick<Action, "asks"> {
  const asks = under(fields, "ask/");
  return asks.length === 0 ? {} : { asks };
}

const NONE: Relation["waypoints"] = [];

function readWaypoints(id: string, positions: OwnerFields): Relation["waypoints"] {
  const found = RESPONSES.flatMap((response) => {
    const text = asJsonText(positions.get(waypointsKey(`${id}|${response}`)));
    return text === undefined ? [] : [[response, text] as const];
  });
  return found.length === 0 ? NONE : found;
}

function readRemaps(fields: OwnerFields): readonly Remap[] {
  const targets = new Map<string, string>();
  for (const [key, value] of fields) {
    const target = asText(value);
    if (key.startsWith("remap/") && target !== undefined) targets.set(key.slice(6), target);
  }
  const sources = listed([...targets.keys()].sort(byText), fields.get("remap"));
  return sources.map((source) => ({ source, target: targets.get(source) ?? "" }));
}
