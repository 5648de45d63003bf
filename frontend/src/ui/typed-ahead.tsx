/** Keeps what a person types while the code of a part with a text field is loading. */
import { type KeyboardEvent, useLayoutEffect, useRef } from "react";
import { keyOf } from "./keys";

export interface Typed {
  readonly text: string;
  /** The key that was pressed after the text. */
  readonly end: "Enter" | "Escape" | null;
}

const NOTHING: Typed = { text: "", end: null };
let typed = NOTHING;

/**
 * An invisible text field in place of the part: without it the keys would be shortcuts of the canvas. Mount it as
 * `waiting` of the part; `useTypedAhead` in the part tells what was typed.
 */
export function TypingField() {
  const field = useRef<HTMLInputElement>(null);
  useLayoutEffect(() => {
    typed = NOTHING;
    field.current?.focus();
    // A part without a text field leaves what was typed, and the next one must not have it.
    return () =>
      queueMicrotask(() => {
        typed = NOTHING;
      });
  }, []);
  const onKeyDown = (event: KeyboardEvent) => {
    event.stopPropagation();
    const key = keyOf(event);
    if (typed.end === null && (key === "Enter" || key === "Escape")) typed = { ...typed, end: key };
  };
  return (
    <input
      ref={field}
      className="visually-hidden"
      aria-label="Loading …"
      onKeyDown={onKeyDown}
      onChange={({ currentTarget }) => {
        if (typed.end === null) typed = { text: currentTarget.value, end: null };
      }}
    />
  );
}

/**
 * Calls `onTyped` once, before the browser paints the part, if something was typed before it was there. The text is
 * read then and not while the part is rendered: keys are taken until the part is in place.
 */
export function useTypedAhead(onTyped: (typed: Typed) => void): void {
  const tell = useRef(onTyped);
  useLayoutEffect(() => {
    const taken = typed;
    typed = NOTHING;
    if (taken !== NOTHING) tell.current(taken);
  }, []);
}
