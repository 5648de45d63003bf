/** A dialog in front of others: Escape closes it alone, and the focus goes back to where it was. */
import { useEffect } from "react";
import { useStableCallback } from "./hooks";
import { keyOf } from "./keys";

const open: (() => void)[] = [];

// Loaded with the page, so that this hears Escape before any dialog does: each would close itself.
globalThis.window?.addEventListener(
  "keydown",
  (event) => {
    const close = open.at(-1);
    if (close === undefined || keyOf(event) !== "Escape") return;
    event.stopImmediatePropagation();
    close();
  },
  { capture: true },
);

const LATER = 30; // ms: whoever closes the dialog may put the focus elsewhere meanwhile

/** Gives the focus to the element that had it before, unless something else took it since the dialog closed. */
function giveBack(before: Element | null, atEnd: Element | null): void {
  const { activeElement: now, body } = document;
  if (now !== atEnd && now !== body) return;
  (atEnd as HTMLElement | null)?.blur();
  (before as HTMLElement | null)?.focus();
  if (document.activeElement !== body) return;
  // What had the focus is gone or off: the dialog behind keeps it.
  [...document.querySelectorAll<HTMLElement>("[role=dialog]")].at(-1)?.focus();
}

/** Makes a dialog the one in front while it is open. */
export function useFrontDialog(isOpen: boolean, onClose: () => void): void {
  const close = useStableCallback(onClose);
  useEffect(() => {
    if (!isOpen) return;
    const before = document.activeElement;
    open.push(close);
    return () => {
      open.splice(open.lastIndexOf(close), 1);
      const atEnd = document.activeElement;
      setTimeout(() => giveBack(before, atEnd), LATER);
    };
  }, [isOpen, close]);
}
