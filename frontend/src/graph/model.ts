/**
 * The model of a UMRF graph on the page: the twin of `umrf/model.py` with names in camelCase.
 *
 * Values are frozen by type; the reader keeps the identity of whatever did not change, so `===`
 * tells whether an action or a relation has to be drawn again. Actions and relations are referred
 * to by key, never by name; `ENTRY` and `EXIT` are the keys of the graph's two ends.
 */

export type Key = string;
/** JSON as it was written: spelling of numbers and order of members are kept. */
export type JsonText = string;
export type Position = readonly [x: number, y: number];
/** The direction in which the graph is drawn. */
export type Direction = "right" | "down";

export const ENTRY = "entry";
export const EXIT = "exit";

export const PRECONDITIONS = ["on_true", "on_false", "on_error", "on_stopped"] as const;
export const RESPONSES = ["run", "pause", "restart", "stop", "bypass", "ignore"] as const;

/** An outcome of the parent. */
export type Precondition = (typeof PRECONDITIONS)[number];
/** The response of a child to an outcome. */
export type Response = (typeof RESPONSES)[number];

/** The response of a child to each outcome of its parent. */
export type Conditions = Readonly<Record<Precondition, Response>>;

export const IGNORE_ALL: Conditions = {
  on_true: "ignore",
  on_false: "ignore",
  on_error: "ignore",
  on_stopped: "ignore",
};
/** The responses that the engine assumes where a file leaves a condition out. */
export const ENGINE_DEFAULTS: Conditions = {
  on_true: "run",
  on_false: "run",
  on_error: "bypass",
  on_stopped: "ignore",
};
/** The only thing an entry relation can say. */
export const ENTRY_CONDITIONS: Conditions = { ...IGNORE_ALL, on_true: "run" };

/** One leaf of the input or output parameters; `text` is usually an object with `pvf_type`. */
export interface Parameter {
  /** The keys that lead to it, joined with `/`; inside a key `~` is `~0` and `/` is `~1`. */
  readonly path: string;
  readonly text: JsonText;
}

export type Extra = readonly (readonly [field: string, text: JsonText])[];

export interface Action {
  readonly key: Key;
  readonly name: string;
  /** The number shown and written: unique for each name, except for twins. */
  readonly instanceId: number;
  readonly type: string;
  readonly actor: string;
  readonly description: string;
  readonly inputs: readonly Parameter[];
  readonly outputs: readonly Parameter[];
  readonly position: Position | null;
  /** Only named by relations, no action of the file: a ghost. */
  readonly missing: boolean;
  /** Has the full name of an earlier action of its file, and keeps it. */
  readonly twin: boolean;
  /** Fields that this model does not know, or known ones whose value does not fit. */
  readonly extra: Extra;
  /** Breakpoints of led runs, as JSON text; absent: none. No file has it. */
  readonly breakpoint?: JsonText;
  /** The inputs, by path, that its author marks to be asked for at a start, each with its bounds; absent: none. */
  readonly asks?: Extra;
}

/** An output of the parent that reaches the child under another name. */
export interface Remap {
  readonly source: string;
  readonly target: string;
}

/** An arrow: what `child` does when `parent` ends. `parent` may be `ENTRY`, `child` may be `EXIT`. */
export interface Relation {
  readonly parent: Key;
  readonly child: Key;
  /** Counts the pairs that a file lists more than once, from 0. */
  readonly listing: number;
  readonly conditions: Conditions;
  readonly required: boolean;
  readonly remap: readonly Remap[];
  /** The one list that has the arrow, where a file lists it on one side only. */
  readonly only: "parents" | "children" | null;
  readonly parentOrder: number;
  readonly childOrder: number;
  readonly parentsExtra: Extra;
  readonly childrenExtra: Extra;
  /** By response: through which places people have led its line, as JSON text. */
  readonly waypoints: readonly (readonly [response: Response, text: JsonText])[];
  /** Breakpoints, in the form of those of an action. */
  readonly breakpoint?: JsonText;
}

export interface Graph {
  readonly name: string;
  readonly description: string;
  /** In the order of the file. */
  readonly actions: readonly Action[];
  /** Sorted by key; the order means nothing. */
  readonly relations: readonly Relation[];
  readonly entryPosition: Position | null;
  readonly exitPosition: Position | null;
  /** Graphs that do not say are drawn top down. */
  readonly direction: Direction;
  /** Notes and frames on the canvas. */
  readonly notes: Extra;
  readonly extra: Extra;
}

export const EMPTY_GRAPH: Graph = {
  name: "",
  description: "",
  actions: [],
  relations: [],
  entryPosition: null,
  exitPosition: null,
  direction: "down",
  notes: [],
  extra: [],
};

/** The name by which the engine knows an action. */
export function fullName(action: Pick<Action, "name" | "instanceId">): string {
  return `${action.name}_${action.instanceId}`;
}

/** The outcomes for which the child does something. */
export function spokenOutcomes(conditions: Conditions): Precondition[] {
  return PRECONDITIONS.filter((outcome) => conditions[outcome] !== "ignore");
}
