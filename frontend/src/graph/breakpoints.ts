/**
 * Breakpoints of a graph: where a led run waits. The document keeps them as JSON text with their action or
 * arrow; no file, version or robot gets them. Pure.
 */
import { flatName, relationId } from "./document-keys";
import {
  type Action,
  ENTRY,
  EXIT,
  fullName,
  type Graph,
  type JsonText,
  type Relation,
  type Response,
} from "./model";

export const ENDS = ["true", "false", "error"] as const;
/** An outcome after which a run can wait. */
export type End = (typeof ENDS)[number];
export const TESTS = ["==", "!=", "<", "<=", ">", ">="] as const;
export type Test = (typeof TESTS)[number];

/** A condition on a value by its flat name, such as `pose::x`. */
export interface ValueTest {
  readonly name: string;
  readonly test: Test;
  readonly value: boolean | number | string;
}

/** A breakpoint on an action or arrow. */
export interface Breakpoint {
  /** Only at this visit of the action, from 1; 0 for each. */
  readonly visit: number;
  /** After the action has ended so. Empty: before it begins; on an arrow: whenever it goes on there. */
  readonly outcomes: readonly End[];
  /** Only if an input meets this, or, after the end, an output. */
  readonly value: ValueTest | null;
}

export const PLAIN: Breakpoint = { visit: 0, outcomes: [], value: null };

/** A breakpoint as the runner takes it. */
export interface RunBreakpoint {
  readonly action: string;
  readonly to?: string;
  readonly visit?: number;
  readonly outcomes?: readonly End[];
  readonly value?: ValueTest | null;
  /** The name of the sub-graph in which both actions stand, wherever a start opens that. */
  readonly inside?: string;
}

const MOST_VISITS = 1_000_000;
const GOES_ON: ReadonlySet<Response> = new Set(["run", "restart", "bypass"]);

function asTest(found: unknown): ValueTest | null | undefined {
  if (found === undefined || found === null) return null;
  if (typeof found !== "object") return undefined;
  const { name, test, value } = found as Record<string, unknown>;
  const known = TESTS.find((each) => each === test);
  const plain = typeof value === "boolean" || typeof value === "string" || Number.isFinite(value);
  if (typeof name !== "string" || name === "" || known === undefined || !plain) return undefined;
  return { name, test: known, value: value as ValueTest["value"] };
}

/** Return the breakpoint that a text of the document says; null for a text that says none. */
export function readBreakpoint(text: JsonText | undefined): Breakpoint | null {
  if (text === undefined || text === "") return null;
  let found: unknown;
  try {
    found = JSON.parse(text);
  } catch {
    return null;
  }
  if (typeof found !== "object" || found === null || Array.isArray(found)) return null;
  const { visit = 0, outcomes = [], value } = found as Record<string, unknown>;
  const test = asTest(value);
  const whole =
    Number.isInteger(visit) && (visit as number) >= 0 && (visit as number) <= MOST_VISITS;
  if (!whole || !Array.isArray(outcomes) || test === undefined) return null;
  if (!outcomes.every((each) => ENDS.includes(each))) return null;
  const said = ENDS.filter((each) => outcomes.includes(each));
  return { visit: visit as number, outcomes: said, value: test };
}

/** Return the text of a breakpoint, without what is as usual. */
export function breakpointText({ visit, outcomes, value }: Breakpoint): JsonText {
  return JSON.stringify({
    ...(visit > 0 && { visit }),
    ...(outcomes.length > 0 && { outcomes }),
    ...(value !== null && { value }),
  });
}

/** Return the outcomes by which an arrow lets its child begin, or the graph end. */
export function endsOn({ conditions }: Pick<Relation, "conditions">): End[] {
  return ENDS.filter((end) => GOES_ON.has(conditions[`on_${end}`]));
}

/** Return why no run can wait at an arrow; null if one can. */
export function whyNoBreakpoint(relation: Relation): string | null {
  if (relation.parent === ENTRY)
    return "The run waits before the first action: put the breakpoint on that.";
  if (endsOn(relation).length > 0) return null;
  return Object.values(relation.conditions).includes("stop")
    ? "This arrow stops an action. A stop always passes: no run waits before one."
    : "Nothing goes on by this arrow, so no run can wait at it.";
}

/** Return the names of the values on which a breakpoint of an action can depend. */
export function valueNames(action: Action, atEnd: boolean): string[] {
  return (atEnd ? action.outputs : action.inputs).map(({ path }) => flatName(path));
}

function parts({ visit, outcomes, value }: Breakpoint): string[] {
  return [
    ...(outcomes.length > 0 ? [`ended ${outcomes.join(" or ")}`] : []),
    ...(visit > 0 ? [`visit ${visit}`] : []),
    ...(value === null ? [] : [`${value.name} ${value.test} ${String(value.value)}`]),
  ];
}

/** Return the conditions of a breakpoint in a few words; "" for none. */
const conditionWords = (breakpoint: Breakpoint): string => parts(breakpoint).join(", ");

/** Return what a breakpoint does, as one sentence without a full stop. `on`: an arrow or an action. */
export function breakpointWords(breakpoint: Breakpoint, on: "action" | "arrow"): string {
  const where =
    on === "arrow"
      ? "A led run waits here"
      : breakpoint.outcomes.length > 0
        ? "A led run waits after this"
        : "A led run waits before this";
  const more = conditionWords(breakpoint);
  return more === "" ? where : `${where}: ${more}`;
}

/** The breakpoints of a graph that count, by action key or relation id. */
export function breakpointsIn(graph: Graph): ReadonlyMap<string, Breakpoint> {
  const found = new Map<string, Breakpoint>();
  for (const action of graph.actions) {
    const own = action.missing ? null : readBreakpoint(action.breakpoint);
    if (own) found.set(action.key, own);
  }
  for (const relation of graph.relations) {
    const own = readBreakpoint(relation.breakpoint);
    if (own && whyNoBreakpoint(relation) === null) found.set(relationId(relation), own);
  }
  return found;
}

/** Return the breakpoints of a graph as a start names them: once for each place. */
export function startBreakpoints(graph: Graph): RunBreakpoint[] {
  const names = new Map(graph.actions.map((each) => [each.key, fullName(each)]));
  names.set(EXIT, EXIT);
  const ends = new Map(
    graph.relations.map((each) => [relationId(each), [each.parent, each.child] as const]),
  );
  const found = new Map<string, RunBreakpoint>();
  for (const [id, { visit, outcomes, value }] of breakpointsIn(graph)) {
    const [parent, child] = ends.get(id) ?? [id, undefined];
    const action = names.get(parent);
    const to = child === undefined ? undefined : names.get(child);
    if (action === undefined || (child !== undefined && to === undefined)) continue;
    const key = JSON.stringify([action, to]);
    if (found.has(key)) continue; // an arrow that a file lists twice
    found.set(key, {
      action,
      ...(to !== undefined && { to }),
      ...(visit > 0 && { visit }),
      ...(outcomes.length > 0 && { outcomes }),
      ...(value !== null && { value }),
    });
  }
  return [...found.values()];
}

/** Return where the breakpoints of a run are on its graph, by action key or relation id, in words. */
export function runMarks(
  graph: Graph,
  breakpoints: readonly RunBreakpoint[],
): ReadonlyMap<string, string> {
  const keys = new Map(graph.actions.map((each) => [fullName(each), each.key]));
  keys.set(EXIT, EXIT);
  const marks = new Map<string, string>();
  for (const { action, to = "", visit = 0, outcomes = [], value = null } of breakpoints) {
    const key = keys.get(action);
    const child = to === "" ? undefined : keys.get(to);
    const arrow = graph.relations.find((each) => each.parent === key && each.child === child);
    const id = to === "" ? key : arrow && relationId(arrow);
    // The runner has filled in all outcomes by which the arrow goes on.
    const whole = arrow !== undefined && outcomes.length === endsOn(arrow).length;
    const said = { visit, outcomes: whole ? [] : outcomes, value };
    if (id !== undefined) marks.set(id, breakpointWords(said, to === "" ? "action" : "arrow"));
  }
  return marks;
}
