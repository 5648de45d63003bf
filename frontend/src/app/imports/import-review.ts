/** Files of old dialects that wait for a person to look at what was translated. */
import type { Preview } from "../../api/graphs";

/** One file that waits. `answer` lets the import go on (true) or drops it. */
export interface ImportUnderReview {
  readonly file: string;
  readonly preview: Preview;
  answer(keep: boolean): void;
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
