/** Names that a new parameter may well have: what its neighbours give or want, and its namesakes have. Pure. */

import { isolated } from "../../words/isolated";
import type { ParameterSide } from "../document-keys";
import type { Action, Graph, Parameter } from "../model";
import { pathWords } from "../value-text";
import { handsOver, readValue } from "./data-flow";

/** `pose.position.x` as a path. */
export function pathFrom(words: string): string {
  return words
    .trim()
    .split(".")
    .filter((part) => part !== "")
    .map((part) => part.replaceAll("~", "~0").replaceAll("/", "~1"))
    .join("/");
}

/** Why a path cannot be used for one more parameter; null when it can. */
export function taken(list: readonly Parameter[], path: string): string | null {
  if (path === "") return "A parameter has a name.";
  const same = list.some((other) => other.path === path);
  if (same) return "There is one of this name.";
  const within = list.some(
    (other) => other.path.startsWith(`${path}/`) || path.startsWith(`${other.path}/`),
  );
  return within ? "This is a group of others." : null;
}

export interface NameSuggestion {
  /** `pose.position.x`. */
  readonly name: string;
  readonly type: string | null;
  /** "given by Look", "wanted by Grip", "as in Look". */
  readonly why: string;
}

/** What arrows tie directly to an action, on the side where a parameter would meet it. */
function neighbours({ actions, relations }: Graph, action: Action, side: ParameterSide): Action[] {
  const keys = new Set(
    relations.filter(handsOver).flatMap(({ parent, child }) => {
      if (side === "in") return child === action.key ? [parent] : [];
      return parent === action.key ? [child] : [];
    }),
  );
  return actions.filter(({ key }) => keys.has(key));
}

/** In the order in which they are likely; each name once. */
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
