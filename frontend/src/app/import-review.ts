/** Files of old dialects that wait for a person to look at what was translated. */
import type { Preview } from "../api/graphs";

/** One file that waits. `answer` lets the import go on (true) or drops it. */
export interface ImportUnderReview {
  readonly file: string;
  readonly preview: Preview;
  answer(keep: boolean): void;
}

/** Nothing was translated and nothing is without a place: there is nothing to look at. */
export function isPlain({ dialect, notes }: Preview): boolean {
  return dialect === "D3" && notes.length === 0;
}

const DIALECTS: Readonly<Record<string, string>> = {
  D0: "a single action",
  "D3-action": "a single action",
  D1: "the first form of graphs (umrf_actions)",
  "D1'": "a shallow graph of the first form",
  D2: "an earlier form of graphs (condition, numbers as states)",
  D3: "the engine’s present form",
  "D3-designer": "the form of the old designer",
};

export function dialectWords(dialect: string): string {
  return DIALECTS[dialect] ?? "another form";
}

/** Usable without React: `subscribe` and `now` fit `useSyncExternalStore`. */
export class ImportReviews {
  #waiting: readonly ImportUnderReview[] = [];
  readonly #listeners = new Set<() => void>();

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  /** The first that waits; null when none does. */
  now = (): ImportUnderReview | null => this.#waiting[0] ?? null;

  /** Asks whether a file shall be kept, after those that wait already. */
  ask(file: string, preview: Preview): Promise<boolean> {
    return new Promise((resolve) => {
      const waiting: ImportUnderReview = {
        file,
        preview,
        answer: (keep) => {
          this.#set(this.#waiting.filter((other) => other !== waiting));
          resolve(keep);
        },
      };
      this.#set([...this.#waiting, waiting]);
    });
  }

  #set(waiting: readonly ImportUnderReview[]): void {
    this.#waiting = waiting;
    for (const listener of [...this.#listeners]) listener();
  }
}

export const importReviews = new ImportReviews();
