/**
 * Drafts: what was typed and is not yet where it belongs. One list for the whole page.
 *
 * A draft counts as unsaved as long as it is held here. Before the page goes, or goes out of sight,
 * every draft is written; one that cannot be written asks its person before the page is closed. Fields
 * get all of this by `useDraft`; `src/tree.test.ts` refuses text fields that have none.
 */
import { createContext, use, useCallback, useEffect, useRef, useState } from "react";

interface PendingDraft {
  readonly text: string;
  /** Writes it and drops it; null while it does not fit its field, or waits for a button. */
  readonly write: (() => void) | null;
  /** True if the draft is written when its person presses Enter or leaves the field, not by itself. */
  readonly held?: boolean;
}

/** Counts of drafts that will be written soon, and of drafts that wait for their person. */
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

  /** Return the counts; the same object until a count changes. */
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
    const writing = all.filter(({ write, held }) => write !== null && held !== true).length;
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

const PAUSE_MS = 700;

/** The key of what the fields inside belong to: an action, an arrow, a note. */
export const DraftOwnerContext = createContext<string | null>(null);

export interface DraftOptions {
  /** The key of what the field belongs to, where no `DraftOwnerContext` tells it. */
  readonly of?: string;
  /** The value that is written now. */
  readonly value: string;
  /** Returns what is wrong with a draft; null when it fits. */
  readonly check?: ((draft: string) => string | null) | undefined;
  /** Writes it. Returns false where there is nothing any more to write it to. */
  readonly onCommit: (value: string) => boolean;
  /** Written on leaving only: what it says is drawn anew, or asked about. */
  readonly onLeaving?: boolean;
}

export interface DraftField {
  /** The text that the field shows. */
  readonly text: string;
  readonly wrong: string | null;
  change(text: string): void;
  /** Writes what fits; an invalid draft stays. */
  commit(): void;
  /** Write what fits, when the field loses the focus. */
  leave(): void;
  discard(): void;
}

export function useDraft(options: DraftOptions): DraftField {
  const { value, check, onLeaving = false } = options;
  const [draft, setDraft] = useState<string | null>(null);
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const around = use(DraftOwnerContext);
  const of = options.of ?? around;
  const latest = useRef({ ...options, draft, of });
  latest.current = { ...options, draft, of };
  // A draft stays in its field after it was written: what others write since is newer than it.
  const unwritten = useRef<string | null>(null);

  const commit = useCallback(() => {
    clearTimeout(timer.current);
    const { current: text } = unwritten;
    const { value, check, onCommit, of } = latest.current;
    if (text === null || check?.(text)) return;
    unwritten.current = null;
    pendingDrafts.drop(latest);
    const write = () => text === value || onCommit(text);
    if (!write()) pendingDrafts.lose({ text, of, why: "gone", write });
  }, []);
  // The field goes: because its person went on, or because a colleague took away what it belongs to.
  useEffect(
    () => () => {
      const isWritten = unwritten.current === null;
      commit();
      const { draft, of } = latest.current;
      const text = unwritten.current ?? (isWritten ? draft : null);
      unwritten.current = null;
      pendingDrafts.drop(latest);
      const why = isWritten ? "written" : "unfit";
      if (text !== null) pendingDrafts.lose({ text, of, why, write: () => false });
    },
    [commit],
  );

  const discard = () => {
    clearTimeout(timer.current);
    unwritten.current = null;
    pendingDrafts.drop(latest);
    setDraft(null);
  };
  const isWrong = (text: string) => Boolean(latest.current.check?.(text));
  return {
    text: draft ?? value,
    wrong: draft === null ? null : (check?.(draft) ?? null),
    change(text) {
      setDraft(text);
      clearTimeout(timer.current);
      unwritten.current = text;
      if (text === latest.current.value) pendingDrafts.drop(latest);
      else
        pendingDrafts.hold(latest, { text, write: isWrong(text) ? null : commit, held: onLeaving });
      if (!onLeaving) timer.current = setTimeout(commit, PAUSE_MS);
    },
    commit,
    leave() {
      commit();
      if (unwritten.current === null) setDraft(null);
    },
    discard,
  };
}

/**
 * Holds text as a draft as long as there is some. Without `write` it waits for its button, and its
 * person is asked before the page goes.
 */
export function usePendingText(text: string, write: (() => void) | null): void {
  const now = useRef(write);
  now.current = write;
  useEffect(() => {
    const { current } = now;
    if (text.trim() === "") pendingDrafts.drop(now);
    else pendingDrafts.hold(now, { text, write: current && (() => now.current?.()) });
  }, [text]);
  useEffect(() => () => pendingDrafts.drop(now), []);
}
