/** Converts names of parameters to paths, and suggests names for a new one. Pure. */

import { isolated } from "../../words/isolated";
import type { ParameterSide } from "../document-keys";
import { pathWords } from "../field-words";
import type { Action, Graph, Parameter } from "../model";
import { handsOver, readValue } from "./data-flow";

/** Returns the path of a typed name: `pose/position/x` for `pose.position.x`. */
export function pathFrom(words: string): string {
  return words
    .trim()
    .split(".")
    .filter((part) => part !== "")
    .map((part) => part.replaceAll("~", "~0").replaceAll("/", "~1"))
    .join("/");
}

/** Returns why a path cannot be used for one more parameter; null when it can. */
export function taken(list: readonly Parameter[], path: string): string | null {
  if (path === "") return "Enter a name for the parameter.";
  const same = list.some((other) => other.path === path);
  if (same) return "Another parameter has this name.";
  const within = list.some(
    (other) => other.path.startsWith(`${path}/`) || path.startsWith(`${other.path}/`),
  );
  return within ? "This name clashes with a group of parameters." : null;
}

export interface NameSuggestion {
  /** The name as it is typed: `pose.position.x`. */
  readonly name: string;
  readonly type: string | null;
  /** "given by Look", "wanted by Grip", "as in Look". */
  readonly why: string;
}

/** Returns the actions that arrows connect directly with an action, on the side where a parameter would meet them. */
function neighbours({ actions, relations }: Graph, action: Action, side: ParameterSide): Action[] {
  const keys = new Set(
    relations.filter(handsOver).flatMap(({ parent, child }) => {
      if (side === "in") return child === action.key ? [parent] : [];
      return parent === action.key ? [child] : [];
    }),
  );
  return actions.filter(({ key }) => keys.has(key));
}

/** Returns likely names for a new parameter, the likeliest first and each name once. */
export function nameSuggestions(
  graph: Graph,
  action: Action,
  side: ParameterSide,
): NameSuggestion[] {
  const own = side === "in" ? action.inputs : action.outputs;
  const found = new Map<string, NameSuggestion>();
  const add = (list: readonly Parameter[], why: string) => {
    for (const parameter of list) {
      const name = pathWords(parameter.path);
      if (found.has(name) || taken(own, parameter.path) !== null) continue;
      found.set(name, { name, type: readValue(parameter).type, why });
    }
  };
  for (const other of neighbours(graph, action, side)) {
    if (side === "in") add(other.outputs, `given by ${isolated(other.name)}`);
    else add(other.inputs, `wanted by ${isolated(other.name)}`);
  }
  for (const other of graph.actions) {
    if (other === action || other.name !== action.name) continue;
    add(side === "in" ? other.inputs : other.outputs, `as in another ${isolated(other.name)}`);
  }
  return [...found.values()];
}
