/**
 * Drafts: what was typed and is not yet where it belongs. One list for the whole page.
 *
 * A draft counts as unsaved as long as it is held here. Before the page goes, or goes out of sight,
 * every draft is written; one that cannot be written asks its person before the page is closed. Fields
 * get all of this by `useDraft`; `src/tree.test.ts` refuses text fields that have none.
 */

interface PendingDraft {
  readonly text: string;
  /** Writes it and drops it; null while it does not fit its field, or waits for a button. */
  readonly write: (() => void) | null;
}

/** How many drafts write themselves soon, and how many wait for their person. */
export interface DraftCounts {
  readonly writing: number;
  readonly waiting: number;
}

/** A draft whose field, and perhaps the thing it belongs to, is gone. */
export interface LostDraft {
  readonly text: string;
  /** The key of what it belongs to: an action, a note, or an arrow; null where that is unknown. */
  readonly of: string | null;
  /**
   * `gone`: there is nothing any more to write it to. `unfit`: it did not fit its field, which went.
   * `written`: it was written, and is lost only if its thing is.
   */
  readonly why: "gone" | "unfit" | "written";
  /** Writes it after all, once its thing is back. Returns whether that was possible. */
  write(): boolean;
}

type Listener = () => void;

class PendingDrafts {
  #drafts = new Map<unknown, PendingDraft>();
  #counts: DraftCounts = { writing: 0, waiting: 0 };
  #listeners = new Set<Listener>();
  #losses = new Set<(lost: LostDraft) => void>();
  #watch: AbortController | null = null;

  /** The same object until a count changes. */
  readonly counts = (): DraftCounts => this.#counts;

  readonly onChange = (listener: Listener): Listener => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  /** Tells of drafts that were lost from now on. */
  onLost(listener: (lost: LostDraft) => void): Listener {
    this.#losses.add(listener);
    return () => this.#losses.delete(listener);
  }

  /** `owner`: the field; another draft of the same field takes the place of this one. */
  hold(owner: unknown, draft: PendingDraft): void {
    this.#drafts.set(owner, draft);
    this.#changed();
  }

  drop(owner: unknown): void {
    if (this.#drafts.delete(owner)) this.#changed();
  }

  /** Its field or its thing is gone: the text is offered to its person. */
  lose(lost: LostDraft): void {
    if (lost.text.trim() === "") return;
    for (const listener of [...this.#losses]) listener(lost);
  }

  /** Writes every draft that fits. */
  flush(): void {
    for (const { write } of [...this.#drafts.values()]) write?.();
  }

  #changed(): void {
    const all = [...this.#drafts.values()];
    const writing = all.filter(({ write }) => write !== null).length;
    const waiting = all.length - writing;
    this.#follow(all.length > 0);
    if (writing === this.#counts.writing && waiting === this.#counts.waiting) return;
    this.#counts = { writing, waiting };
    for (const listener of [...this.#listeners]) listener();
  }

  /** Listens to the page only while there are drafts: a listener of `beforeunload` has its price. */
  #follow(needed: boolean): void {
    if (!needed) {
      this.#watch?.abort();
      this.#watch = null;
    } else if (this.#watch === null) {
      this.#watch = new AbortController();
      const { signal } = this.#watch;
      const onHidden = () => document.visibilityState === "hidden" && this.flush();
      document.addEventListener("visibilitychange", onHidden, { signal });
      window.addEventListener("pagehide", () => this.flush(), { signal });
      // Before the room looks whether everything is stored.
      window.addEventListener("beforeunload", this.#onLeave, { signal, capture: true });
    }
  }

  #onLeave = (event: BeforeUnloadEvent): void => {
    this.flush();
    if (this.#drafts.size > 0) event.preventDefault();
  };
}

export const pendingDrafts = new PendingDrafts();
