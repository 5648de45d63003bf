/** Keeps what a person types while the code of a part with a text field is loading. */
import {
  type KeyboardEvent as Press,
  type RefObject,
  useLayoutEffect,
  useRef,
  useState,
} from "react";
import { keyOf } from "./keys";

interface Typed {
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
  const onKeyDown = (event: Press) => {
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
 * Calls `onText` once with what was typed before the part was there, and then presses the key that followed in the
 * part's `field`. What was typed is read before the browser paints the part and not while the part is rendered: keys
 * are taken until the part is in place.
 */
export function useTypedAhead(
  field: RefObject<HTMLElement | null>,
  onText: (text: string) => void,
): void {
  const tell = useRef(onText);
  const [end, setEnd] = useState<Typed["end"]>(null);
  useLayoutEffect(() => {
    const taken = typed;
    typed = NOTHING;
    if (taken === NOTHING) return;
    tell.current(taken.text);
    setEnd(taken.end);
  }, []);
  useLayoutEffect(() => {
    if (end === null) return;
    field.current?.dispatchEvent(new KeyboardEvent("keydown", { key: end, bubbles: true }));
  }, [end, field]);
}
