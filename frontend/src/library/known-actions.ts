/** The actions that can be added: those of the library and what graphs use besides, each once. */
import { useMemo } from "react";
import { type LibraryAction, useLibrary } from "../api/documents/library";
import type { NewAction } from "../graph/edit";
import { pathWords } from "../graph/value-text";

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

function knownAction(answer: LibraryAction): KnownAction {
  const { name, type, description, inputs, outputs, used_in, document } = answer;
  const bare = (list: Parameters) => list.map(({ path, text }) => ({ path, text }));
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

/** `location, pose.position.x`, for a line under the name. */
export function signature(template: NewAction): string {
  const names = (template.inputs ?? []).map((input) => pathWords(input.path));
  return names.length === 0 ? "no parameters" : names.join(", ");
}
