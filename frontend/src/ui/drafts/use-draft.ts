/** The draft of one field: written when it fits and the typing pauses, or when the field is left. */
import { createContext, use, useCallback, useEffect, useRef, useState } from "react";
import { pendingDrafts } from "./pending-drafts";

const PAUSE_MS = 700;

/** The key of what the fields inside belong to: an action, an arrow, a note. */
export const DraftOwnerContext = createContext<string | null>(null);

export interface DraftOptions {
  /** The key of what the field belongs to, where no `DraftOwnerContext` tells it. */
  readonly of?: string;
  /** What is written now. */
  readonly value: string;
  /** What is wrong with a draft; null when it fits. */
  readonly check?: ((draft: string) => string | null) | undefined;
  /** Writes it. Returns false where there is nothing any more to write it to. */
  readonly onCommit: (value: string) => boolean;
  /** Written on leaving only: what it says is drawn anew, or asked about. */
  readonly onLeaving?: boolean;
}

export interface DraftField {
  /** What the field shows. */
  readonly text: string;
  readonly wrong: string | null;
  change(text: string): void;
  /** Writes what fits; an invalid draft stays. */
  commit(): void;
  /** As `commit`, when the field is left. */
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
      else pendingDrafts.hold(latest, { text, write: isWrong(text) ? null : commit });
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
