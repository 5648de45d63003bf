/** Shortcuts of deeds, where nobody is typing. */
import { useEffect, useRef } from "react";
import type { Bench } from "../bench";
import { DEEDS } from "./all";
import { deedFor, isEnabled } from "./deed";

/** Whether keys belong to what has the focus. */
function isTaken(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target.isContentEditable) return true;
  return (
    target.closest("input, textarea, select, [role=dialog], [role=menu], [role=listbox]") !== null
  );
}

/** The pointer rests on the canvas and nothing has the focus: Tab is free for the search. */
function isOverCanvas(): boolean {
  const idle = document.activeElement === document.body || document.activeElement === null;
  return idle && document.querySelector(".react-flow__pane:hover") !== null;
}

export function useShortcuts(bench: Bench): void {
  const now = useRef(bench);
  now.current = bench;
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (event.defaultPrevented || isTaken(event.target)) return;
      if (event.key === "/") {
        event.preventDefault();
        document.querySelector<HTMLInputElement>("[data-search]")?.focus();
        return;
      }
      if (event.key === "Tab" && isOverCanvas()) {
        event.preventDefault();
        now.current.openAdd();
        return;
      }
      if (event.key === "Escape") {
        now.current.select([]);
        return;
      }
      const deed = deedFor(DEEDS, event);
      if (deed === null) return;
      // What a deed takes is also kept from the browser while the deed has nothing to do.
      event.preventDefault();
      if (isEnabled(deed, now.current)) deed.run(now.current);
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
}
