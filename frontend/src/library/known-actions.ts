/** The actions that can be added: what the graphs of this server use, each once. */
import { useMemo } from "react";
import { type KnownActionAnswer, useActions } from "../api/graphs";
import type { NewAction } from "../graph/edit";
import { pathWords } from "../graph/value-text";

export interface KnownAction {
  readonly template: NewAction;
  /** The graphs that use it, by id. */
  readonly usedIn: readonly string[];
  /** Its parameters with their types, for people. */
  readonly takes: readonly string[];
  readonly gives: readonly string[];
}

type Parameters = KnownActionAnswer["inputs"];

const words = (list: Parameters): string[] =>
  list.map(
    ({ path, pvf_type, required }) =>
      `${pathWords(path)}: ${pvf_type ?? "no type"}${required ? "" : ", optional"}`,
  );

function knownAction(answer: KnownActionAnswer): KnownAction {
  const { name, type, description, inputs, outputs, used_in } = answer;
  const bare = (list: Parameters) => list.map(({ path, text }) => ({ path, text }));
  return {
    template: { name, type, description, inputs: bare(inputs), outputs: bare(outputs) },
    usedIn: used_in,
    takes: words(inputs),
    gives: words(outputs),
  };
}

const NONE: readonly KnownActionAnswer[] = [];

export function useKnownActions(): { actions: readonly KnownAction[]; ready: boolean } {
  const { data = NONE, isPending } = useActions();
  const actions = useMemo(() => data.map(knownAction), [data]);
  return { actions, ready: !isPending };
}

/** `location, pose.position.x`, for a line under the name. */
export function signature(template: NewAction): string {
  const names = (template.inputs ?? []).map((input) => pathWords(input.path));
  return names.length === 0 ? "no parameters" : names.join(", ");
}
