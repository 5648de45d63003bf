/** Keys and presses of a list of links: one listener for all of them, however many there are. */
import { type RefObject, useEffect } from "react";
import { useLocation, useRouter } from "wouter";
import { keyOf } from "../ui/keys";

/** Up and down go from row to row, and from the search into the list. */
export function useRowKeys(list: RefObject<HTMLElement | null>): void {
  useEffect(() => {
    const element = list.current;
    const walk = (event: KeyboardEvent) => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[keyOf(event)];
      if (step === undefined || element === null) return;
      const rows = [...element.querySelectorAll<HTMLElement>("[data-row], [data-search]")];
      const at = rows.findIndex((row) => row.contains(document.activeElement));
      if (at < 0) return;
      event.preventDefault();
      rows[Math.max(0, Math.min(rows.length - 1, at + step))]?.focus();
    };
    element?.addEventListener("keydown", walk);
    return () => element?.removeEventListener("keydown", walk);
  }, [list]);
}

/** A plain press of a link inside goes there without loading the page anew. */
export function useRowPresses(list: RefObject<HTMLElement | null>): void {
  const { base } = useRouter();
  const [, go] = useLocation();
  useEffect(() => {
    const element = list.current;
    const press = (event: MouseEvent) => {
      const { target, button, metaKey, ctrlKey, shiftKey, altKey } = event;
      if (button !== 0 || metaKey || ctrlKey || shiftKey || altKey) return;
      const link = target instanceof Element ? target.closest("a[data-row]") : null;
      const to = link?.getAttribute("href");
      if (!to) return;
      event.preventDefault();
      go(to.slice(base.length));
    };
    element?.addEventListener("click", press);
    return () => element?.removeEventListener("click", press);
  }, [list, base, go]);
}
