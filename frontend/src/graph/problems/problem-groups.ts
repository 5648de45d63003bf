/** Groups checked problems for people: one thing is shown once, however many fields it has. Pure. */

import { pathWords } from "../field-words";
import { type Action, fullName, type Graph, type Key } from "../model";
import { type DataFlow, dataFlowOf, readValue } from "../parameters/data-flow";
import { groupOf } from "../parameters/groups";
import { spokenText } from "../spoken-text";
import { type CheckedProblem, inputOf, kindOf, type ProblemKind } from "./problem-kinds";

export interface ProblemGroup<P extends CheckedProblem = CheckedProblem> {
  /** An id that stays the same for the same thing, however often it is checked. */
  readonly id: string;
  readonly kind: ProblemKind;
  /** True if it keeps the graph from starting. */
  readonly blocks: boolean;
  readonly code: string;
  /** The message, without the code. */
  readonly message: string;
  /** The thing that it is about: the id of an arrow, else the key of an action; null for the graph as a whole. */
  readonly place: string | null;
  /** The path of the inputs to fill in, as a whole; null for any other problem. */
  readonly group: string | null;
  /** The inputs without a value, by path; they can be filled in where the problem is shown. */
  readonly inputs: readonly string[];
  /** True if a start asks for these, so that they need not be filled in. */
  readonly isAsked: boolean;
  /** All checked problems that it stands for, at least one. */
  readonly problems: readonly [P, ...P[]];
}

/** Returns the place of a problem on the canvas: a relation, else an action; null for the graph as a whole. */
export function placeOf({ where }: Pick<CheckedProblem, "where">): string | null {
  return where.relation ?? where.aid ?? null;
}

interface Gathered<P extends CheckedProblem> {
  id: string;
  kind: ProblemKind;
  group: string | null;
  problems: [P, ...P[]];
}

const ORDER: Readonly<Record<ProblemKind, number>> = {
  wrong: 0,
  "fill-in": 1,
  warning: 2,
  note: 3,
};

/** Joins words: "x", "x and y", "x, y and z". */
function listed(words: readonly string[]): string {
  return words.length < 2 ? words.join("") : `${words.slice(0, -1).join(", ")} and ${words.at(-1)}`;
}

/** Returns the message about inputs without a value. */
function unwrittenWords(group: string, paths: readonly string[], isAsked: boolean): string {
  const end = isAsked ? "here or at each start" : "or it never runs";
  const what = pathWords(group);
  const parts = paths.map((path) => pathWords(path.slice(group.length + 1)));
  const [only] = paths;
  if (only === group) return `${what} is still to fill in, ${end}.`;
  return `${what}: ${listed(parts)} still to fill in, ${end}.`;
}

function told<P extends CheckedProblem>(
  { id, kind, group, problems }: Gathered<P>,
  actions: ReadonlyMap<Key, Action>,
  names: ReadonlySet<string>,
): ProblemGroup<P> {
  const [first] = problems;
  const inputs = group === null ? [] : problems.flatMap((each) => inputOf(each) ?? []);
  const isAsked = inputs.length > 0 && isAskedFor(actions.get(first.where.aid ?? ""), inputs);
  return {
    id,
    kind,
    blocks: !isAsked && problems.some(({ severity }) => severity === "error"),
    code: first.code,
    message:
      group === null ? spokenText(first.message, names) : unwrittenWords(group, inputs, isAsked),
    place: placeOf(first),
    group,
    inputs,
    isAsked,
    problems,
  };
}

/** Returns true if a start asks for inputs without a value: for all of a type that people can give. */
const isAskedFor = (action: Action | undefined, paths: readonly string[]): boolean =>
  action?.inputs.every((each) => !paths.includes(each.path) || readValue(each).native) ?? false;

/** Returns a function that tells whether every giver of an input brings a value that the input cannot take. */
function misfitsIn(flow: DataFlow) {
  return (aid: Key, path: string): boolean => {
    const givers = flow.get(aid)?.get(path) ?? [];
    return givers.length > 0 && givers.every(({ misfit }) => misfit !== null);
  };
}

/**
 * Returns the problems to show: first what is wrong, then what to fill in, then what may go wrong, then notes; in
 * each kind what blocks a start comes first.
 */
export function problemGroups<P extends CheckedProblem>(
  problems: readonly P[],
  graph: Pick<Graph, "actions" | "relations">,
): ProblemGroup<P>[] {
  const misfits = misfitsIn(dataFlowOf(graph));
  const actions = new Map(graph.actions.map((action) => [action.key, action]));
  const found = new Map<string, Gathered<P>>();
  for (const problem of problems) {
    const kind = kindOf(problem, misfits);
    const { aid } = problem.where;
    const input = kind === "fill-in" && aid !== undefined ? inputOf(problem) : null;
    const list = actions.get(aid ?? "")?.inputs ?? [];
    const group = input === null ? null : groupOf(list, input);
    // Problems with the same words at the same place are one, whichever lines of the file they are in.
    const what = group === null ? problem.message : `in/${group}`;
    const id = `${kind} ${problem.code} ${placeOf(problem) ?? ""} ${what}`;
    const known = found.get(id);
    if (known) known.problems.push(problem);
    else found.set(id, { id, kind, group, problems: [problem] });
  }
  const names = new Set(graph.actions.map(fullName));
  const rank = ({ kind, blocks }: ProblemGroup) => 2 * ORDER[kind] + (blocks ? 0 : 1);
  return [...found.values()]
    .map((each) => told(each, actions, names))
    .sort((a, b) => rank(a) - rank(b));
}

/** Returns the other places that have the same problem. */
export function otherPlaces(problem: Pick<CheckedProblem, "also">): string[] {
  return (problem.also ?? []).flatMap((where) => placeOf({ where }) ?? []);
}
