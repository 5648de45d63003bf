/** Files of old dialects that wait for a person to look at what was translated. */
import type { Preview } from "../../api/graphs";
import { Watched } from "../../ui/watched";

/** One file that waits. `answer` lets the import go on (true) or drops it. */
export interface ImportUnderReview {
  readonly file: string;
  readonly preview: Preview;
  answer(keep: boolean): void;
}

/** A queue for the whole page: files arrive on every screen. */
export class ImportReviews {
  readonly #waiting = new Watched<readonly ImportUnderReview[]>([]);

  readonly subscribe = this.#waiting.subscribe;

  /** The first that waits; null when none does. */
  now = (): ImportUnderReview | null => this.#waiting.now()[0] ?? null;

  /** Asks whether a file shall be kept, after those that wait already. */
  ask(file: string, preview: Preview): Promise<boolean> {
    return new Promise((resolve) => {
      const waiting: ImportUnderReview = {
        file,
        preview,
        answer: (keep) => {
          this.#waiting.set(this.#waiting.now().filter((other) => other !== waiting));
          resolve(keep);
        },
      };
      this.#waiting.set([...this.#waiting.now(), waiting]);
    });
  }
}

export const importReviews = new ImportReviews();
