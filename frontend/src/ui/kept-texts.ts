/** Texts that wait for a button, such as comments: kept in the tab, by graph and person. */
import { useCallback, useSyncExternalStore } from "react";
import { pendingDrafts } from "./drafts";

const PREFIX = "aa.draft.";
/** Longer texts are in the page only: a browser stores some MiB, and writes them at each letter. */
const LONGEST = 1 << 20;

/** The beginning of the keys of one person's texts in one graph. */
export const textScope = (graph: string, person: string): string => `${graph}/${person}/`;

/** The beginning of the keys of what somebody typed for a start: no part of the graph, and so not waiting for it. */
export const startScope = (graph: string, person: string): string =>
  `start ${textScope(graph, person)}`;

function stored(): Map<string, string> {
  try {
    const keys = Object.keys(sessionStorage).filter((key) => key.startsWith(PREFIX));
    return new Map(
      keys.map((key) => [key.slice(PREFIX.length), sessionStorage.getItem(key) ?? ""]),
    );
  } catch {
    return new Map(); // a browser that keeps nothing has them on this page
  }
}

class KeptTexts {
  #texts: Map<string, string> | null = null;
  #listeners = new Set<() => void>();
  /** Held as drafts of this page, since the tab does not keep them. */
  #unstored = new Set<string>();

  #all(): Map<string, string> {
    this.#texts ??= stored();
    return this.#texts;
  }

  readonly onChange = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  get(key: string): string {
    return this.#all().get(key) ?? "";
  }

  /** Return how many texts are kept; those that cannot be stored are among `pendingDrafts`. */
  count(scope: string): number {
    const keys = [...this.#all().keys()].filter((key) => key.startsWith(scope));
    return keys.filter((key) => !this.#unstored.has(key)).length;
  }

  /** Keeps a text; an empty one is let go. */
  set(key: string, text: string): void {
    if (text === "") this.#all().delete(key);
    else this.#all().set(key, text);
    try {
      sessionStorage.removeItem(PREFIX + key);
      if (text.length > LONGEST) throw new RangeError("too long to be kept");
      if (text !== "") sessionStorage.setItem(PREFIX + key, text);
      this.#unstored.delete(key);
    } catch {
      // It is in this page only: its person is asked before the page goes.
      this.#unstored.add(key);
    }
    if (text !== "" && this.#unstored.has(key)) pendingDrafts.hold(key, { text, write: null });
    else pendingDrafts.drop(key);
    for (const listener of [...this.#listeners]) listener();
  }
}

export const keptTexts = new KeptTexts();

/** A text that waits for a button, and how to change it. */
export function useKeptText(key: string): readonly [string, (text: string) => void] {
  const text = useSyncExternalStore(keptTexts.onChange, () => keptTexts.get(key));
  return [text, useCallback((next: string) => keptTexts.set(key, next), [key])];
}

/** Return how many texts of a person wait in a graph. */
export function useWaitingTexts(scope: string): number {
  return useSyncExternalStore(keptTexts.onChange, () => keptTexts.count(scope));
}
