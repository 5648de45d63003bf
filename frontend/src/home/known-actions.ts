/**
 * Actions and graphs that can be placed: those of the library, those used in graphs, and graphs,
 * each once.
 */
import { useMemo } from "react";
import {
  type GraphAsAction,
  type LibraryAction,
  useGraphsAsActions,
  useLibrary,
} from "../api/library";
import type { NewAction } from "../graph/edit";
import { pathWords } from "../graph/field-words";
import { isReadyMade } from "../graph/questions";

export interface KnownAction {
  readonly template: NewAction;
  /** Its document in the library; null: only graphs use it. */
  readonly document: string | null;
  /** The graphs that use it, by id. */
  readonly usedIn: readonly string[];
  /** Its parameters with their types, for people. */
  readonly takes: readonly string[];
  readonly gives: readonly string[];
}

type Parameters = LibraryAction["inputs"];

const words = (list: Parameters): string[] =>
  list.map(
    ({ path, pvf_type, required }) =>
      `${pathWords(path)}: ${pvf_type ?? "no type"}${required ? "" : ", optional"}`,
  );

const bare = (list: Parameters) => list.map(({ path, text }) => ({ path, text }));

function knownAction(answer: LibraryAction): KnownAction {
  const { name, type, description, inputs, outputs, used_in, document } = answer;
  return {
    template: { name, type, description, inputs: bare(inputs), outputs: bare(outputs) },
    document,
    usedIn: used_in,
    takes: words(inputs),
    gives: words(outputs),
  };
}

const NONE: readonly LibraryAction[] = [];

export function useKnownActions(): { actions: readonly KnownAction[]; ready: boolean } {
  const { data = NONE, isPending } = useLibrary();
  const actions = useMemo(() => data.map(knownAction), [data]);
  return { actions, ready: !isPending };
}

/** A graph, as the action that stands for it in another. */
export interface KnownGraph {
  readonly graph: string;
  readonly template: NewAction;
}

const NO_GRAPHS: readonly GraphAsAction[] = [];

const pathsOf = ({ inputs = [], outputs = [] }: NewAction): string =>
  JSON.stringify([inputs, outputs].map((list) => list.map(({ path }) => path).sort()));

interface Placeable {
  readonly actions: readonly KnownAction[];
  readonly graphs: readonly KnownGraph[];
}

/**
 * Returns what can be placed, each name once. Engines look for an action before a graph of its name, so that one of the library
 * comes first; one that only graphs use, with the parameters of a graph of its name, is that graph.
 */
export function placeable(
  actions: readonly KnownAction[],
  graphs: readonly KnownGraph[],
  current: string | undefined,
): Placeable {
  const own = new Set(actions.flatMap(({ document, template }) => (document ? template.name : [])));
  const byName = new Map(graphs.map(({ template }) => [template.name, pathsOf(template)]));
  const isGraph = ({ document, template }: KnownAction) =>
    document === null && byName.get(template.name) === pathsOf(template);
  const seen = new Set<string>();
  const others = graphs.filter(({ graph, template: { name } }) => {
    const first = graph !== current && !own.has(name) && !seen.has(name);
    if (first) seen.add(name);
    return first;
  });
  return { actions: actions.filter((action) => !isGraph(action)), graphs: others };
}

/** Return all that can be placed in a graph, without the graph itself. */
export function usePlaceable(current: string | undefined): Placeable & { ready: boolean } {
  const { actions, ready } = useKnownActions();
  const { data = NO_GRAPHS } = useGraphsAsActions();
  return useMemo(() => {
    const graphs = data.map(({ graph, name, description, inputs, outputs }) => {
      const template: NewAction = {
        name,
        description,
        inputs: bare(inputs),
        outputs: bare(outputs),
        ofGraph: true,
      };
      return { graph, template };
    });
    // Ready-made ones are offered as such, whether graphs use them or not.
    const others = actions.filter(({ template }) => !isReadyMade(template));
    return { ...placeable(others, graphs, current), ready };
  }, [actions, data, current, ready]);
}

/**
 * Return all placeable things for a search by name; of an action and a graph with one name, only
 * the action.
 */
export function templatesOf({ actions, graphs }: Placeable): NewAction[] {
  const all = [...actions, ...graphs].map(({ template }) => template);
  return [
    ...new Map(all.reverse().map((template) => [template.name, template])).values(),
  ].reverse();
}

/** Return the inputs of an action for a line under its name, as `location, pose.position.x`. */
export function signature(template: NewAction): string {
  const names = (template.inputs ?? []).map((input) => pathWords(input.path));
  return names.length === 0 ? "no parameters" : names.join(", ");
}
