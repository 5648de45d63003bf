/**
 * Says in sentences what an arrow means: what the engine would do, not what the words suggest.
 *
 * So `restart` is said to do nothing (the engine does nothing), and joins are said as the engine
 * waits: a required parent only has to have ended, and the last one decides.
 */

import { isolated } from "../words/isolated";
import {
  ENTRY,
  EXIT,
  type Graph,
  type Key,
  PRECONDITIONS,
  type Precondition,
  type Relation,
  type Response,
} from "./model";
import { shownName } from "./questions";
import { handOverOf, robotOf, robotWord } from "./robots";
import { endLabel } from "./spoken-name";

/** Words for how an action ended, after its name: "Scan ends true". */
const ENDINGS: Readonly<Record<Precondition, string>> = {
  on_true: "ends true",
  on_false: "ends false",
  on_error: "ends with an error",
  on_stopped: "is stopped",
};

/** Returns the name of an end of a relation, with its number only where the name is not enough. */
export function nameOf(graph: Graph, key: Key): string {
  if (key === ENTRY) return "the start";
  if (key === EXIT) return "the end";
  const action = graph.actions.find((candidate) => candidate.key === key);
  if (action === undefined) return "something deleted";
  const shared = graph.actions.some((other) => other !== action && other.name === action.name);
  const name = shownName(action.name);
  return shared ? `${name} ${action.instanceId}` : name;
}

/** Returns what one arrow makes its child do, one sentence for each thing. */
export function relationWords(graph: Graph, relation: Relation): readonly string[] {
  if (relation.parent === ENTRY) return ["Runs when the graph starts."];
  const parent = nameOf(graph, relation.parent);
  if (relation.only !== null && relation.child !== EXIT) return [oneSidedWords(relation, parent)];
  const toEnd = relation.child === EXIT;
  const sentences = groups(relation).map(({ response, outcomes }) => {
    const when = `${isolated(parent)} ${any(outcomes.map((outcome) => ENDINGS[outcome]))}`;
    return toEnd ? endWords(response, when) : responseWords(response, when);
  });
  if (sentences.length > 0) return sentences;
  return [`Does nothing, however ${isolated(parent)} ends.`];
}

/** The outcomes for which an arrow does nothing, as a sentence; null when there are none. */
export function ignoredWords(graph: Graph, relation: Relation): string | null {
  if (relation.parent === ENTRY || relation.only !== null) return null;
  const ignored = PRECONDITIONS.filter((outcome) => relation.conditions[outcome] === "ignore");
  if (ignored.length === 0 || ignored.length === PRECONDITIONS.length) return null;
  const endings = any(ignored.map((outcome) => ENDINGS[outcome]));
  return `Nothing happens when ${isolated(nameOf(graph, relation.parent))} ${endings}.`;
}

/**
 * Return what an arrow between two robots means, one sentence for each response: "Scout starts
 * Inspect when Carrier’s DriveTo ends true."; empty for other arrows.
 */
export function handOverWords(graph: Graph, relation: Relation): readonly string[] {
  const hand = handOverOf(relation, robotOf(graph));
  if (hand === null) return [];
  const [parent, child] = [nameOf(graph, relation.parent), nameOf(graph, relation.child)];
  return groups(relation).flatMap(({ response, outcomes }) => {
    const verb = HANDED[response];
    if (verb === undefined) return [];
    const ends = any(outcomes.map((outcome) => ENDINGS[outcome]));
    const starter = hand.to === "" ? "Any robot" : isolated(hand.to);
    const inCase = response === "stop" || response === "pause" ? ", if it runs," : "";
    return `${starter} ${verb} ${isolated(child)}${inCase} when ${robotWord(hand.from)}’s ${isolated(parent)} ${ends}.`;
  });
}

const HANDED: Readonly<Partial<Record<Response, string>>> = {
  run: "starts",
  stop: "stops",
  pause: "pauses",
  bypass: "passes over",
};

/** Return an action of another robot in words, as one waits for it: "Carrier: DriveTo". */
export function robotActionWords(graph: Graph, key: Key): string {
  const robot = graph.actions.find((action) => action.key === key)?.actor ?? "";
  const own = isolated(nameOf(graph, key));
  return robot === "" ? own : `${isolated(robot)}: ${own}`;
}

/** Returns when an action runs, or the graph ends: by all its arrows, and how they wait for each other. */
export function startWords(graph: Graph, key: Key): readonly string[] {
  const relations = graph.relations
    .filter((relation) => relation.child === key)
    .sort((a, b) => a.childOrder - b.childOrder);
  if (relations.length === 0) {
    return [
      key === EXIT ? "Nothing ends this graph: it halts or runs on." : "Nothing starts this.",
    ];
  }
  const wait = waitWords(graph, relations);
  return [
    ...relations.flatMap((relation) => relationWords(graph, relation)),
    ...(wait === null ? [] : [wait]),
  ];
}

/** A file that lists a relation on one side only (hazards H2 and H2b). */
function oneSidedWords(relation: Relation, parent: string): string {
  if (relation.only === "children") {
    return `Only ${isolated(parent)} lists this arrow: the engine breaks down when ${isolated(parent)} ends.`;
  }
  return relation.required
    ? `${isolated(parent)} does not list this arrow, but this action waits for it: it never runs.`
    : `${isolated(parent)} does not list this arrow: the arrow does nothing.`;
}

function groups(relation: Relation): { response: Response; outcomes: Precondition[] }[] {
  const found: { response: Response; outcomes: Precondition[] }[] = [];
  for (const outcome of PRECONDITIONS) {
    const response = relation.conditions[outcome];
    if (response === "ignore") continue;
    const group = found.find((candidate) => candidate.response === response);
    if (group) group.outcomes.push(outcome);
    else found.push({ response, outcomes: [outcome] });
  }
  return found;
}

function responseWords(response: Response, when: string): string {
  switch (response) {
    case "run":
      return `Runs when ${when}.`;
    case "stop":
      return `Is stopped, if it runs, when ${when}.`;
    case "pause":
      return `Is paused, if it runs, when ${when}; it goes on only when the graph is resumed.`;
    case "restart":
      return `Nothing happens when ${when}: the engine knows “restart” but does not do it.`;
    case "bypass":
      return `Is bypassed when ${when}: the actions after it start at once.`;
    case "ignore":
      return `Does nothing when ${when}.`;
  }
}

/** For the engine run, stop, pause and restart of the end are all one. */
function endWords(response: Response, when: string): string {
  return response === "bypass"
    ? `The graph ends at once when ${when}, whatever else it waits for.`
    : `The graph ends when ${when}.`;
}

function waitWords(graph: Graph, relations: readonly Relation[]): string | null {
  const starts = relations.some((relation) => relation.parent === ENTRY);
  const parents = relations.filter((relation) => relation.parent !== ENTRY);
  const names = (some: readonly Relation[]) =>
    all(some.map((r) => isolated(nameOf(graph, r.parent))));
  const required = parents.filter((relation) => relation.required);
  const free = parents.filter((relation) => !relation.required);
  if (starts && required.length > 0) {
    return `Waits for ${names(required)} also at the start, so it cannot be the first.`;
  }
  if (parents.length < 2) return null;
  if (free.length === 0) return `Waits until ${names(required)} have ended; the last one decides.`;
  if (required.length === 0)
    return "Does not wait for the others: each arrow acts on its own, every time.";
  const ended = required.length > 1 ? "have ended" : "has ended";
  return `Waits until ${names(required)} ${ended}, not for ${names(free)}.`;
}

const list = (word: string) => (items: readonly string[]) =>
  items.length < 2
    ? items.join("")
    : `${items.slice(0, -1).join(", ")} ${word} ${items[items.length - 1]}`;
const any = list("or");
const all = list("and");
/** Returns the name of an end of a relation, with its number only where the name is not enough. */

export function endName(graph: Graph, key: Key): string {
  const end = endLabel(key);
  if (end !== null) return end;
  const action = graph.actions.find((candidate) => candidate.key === key);
  if (!action) return "something deleted";
  const shared = graph.actions.some((other) => other !== action && other.name === action.name);
  const name = shownName(action.name);
  return shared ? `${isolated(name)} ${action.instanceId}` : name;
}
