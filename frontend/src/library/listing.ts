/** Collects the actions of the library, of graphs and of robots into one list, and filters it. Pure. */
import type { LibraryAction } from "../api/library";
import { pathWords } from "../graph/field-words";
import type { RobotAction, RobotsKnowledge } from "../home/robot-actions";

/** One action by its name. `action`: null if only robots have it. */
export interface ListedAction {
  readonly name: string;
  readonly action: LibraryAction | null;
  readonly robots: readonly RobotAction[];
  /** The line below its name. */
  readonly summary: string;
  /** Lower-case text that the search looks through. */
  readonly words: string;
}

/** The filter of the list; `robot:NAME` keeps the actions that this robot has. */
export type ActionFilter = "all" | "library" | "graphs" | `robot:${string}`;

const names = (list: LibraryAction["inputs"]): string[] =>
  list.map((parameter) => pathWords(parameter.path));

/** Return the top-level names of the parameters, each once, such as `pose` for `pose.position.x`. */
function summaryOf(inputs: readonly string[]): string {
  const heads = [...new Set(inputs.map((name) => name.split(".")[0] ?? name))];
  return heads.length === 0 ? "no parameters" : heads.join(", ");
}

function listed(action: LibraryAction, robots: readonly RobotAction[]): ListedAction {
  const { name, description, inputs, outputs, labels } = action;
  const takes = names(inputs);
  const words = [name, description, ...takes, ...names(outputs), ...labels].join(" ").toLowerCase();
  return { name, action, robots, summary: summaryOf(takes), words };
}

function ofRobots(name: string, robots: readonly RobotAction[]): ListedAction {
  const inputs = Object.keys(robots[0]?.action.inputs ?? {}).map((flat) =>
    flat.replaceAll("::", "."),
  );
  const words = [name, ...inputs].join(" ").toLowerCase();
  return { name, action: null, robots, summary: summaryOf(inputs), words };
}

/** Return all actions in the order of their names, each name once. */
export function listedActions(
  library: readonly LibraryAction[],
  { byName }: Pick<RobotsKnowledge, "byName">,
): ListedAction[] {
  const known = library.map((action) => listed(action, byName.get(action.name) ?? []));
  const taken = new Set(library.map(({ name }) => name));
  const others = [...byName].flatMap(([name, robots]) =>
    taken.has(name) ? [] : [ofRobots(name, robots)],
  );
  return others.length === 0 ? known : [...known, ...others].sort(byTheirNames);
}

const byTheirNames = (a: ListedAction, b: ListedAction) =>
  a.name.localeCompare(b.name, undefined, { numeric: true });

function passes({ action, robots }: ListedAction, filter: ActionFilter): boolean {
  switch (filter) {
    case "all":
      return true;
    case "library":
      return action !== null && action.document !== null;
    case "graphs":
      return action !== null && action.document === null;
    default:
      return robots.some(({ robot }) => `robot:${robot}` === filter);
  }
}

/** Return the actions that pass the filter and contain every word of the search. */
export function foundActions(
  all: readonly ListedAction[],
  filter: ActionFilter,
  search: string,
): ListedAction[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  return all.filter(
    (each) => passes(each, filter) && words.every((word) => each.words.includes(word)),
  );
}

/** Return the address of an action: that of its document, else one with its name. */
export function addressOf({ name, action }: Pick<ListedAction, "name" | "action">): string {
  return action?.document
    ? `/actions/${encodeURIComponent(action.document)}`
    : `/actions?name=${encodeURIComponent(name)}`;
}
