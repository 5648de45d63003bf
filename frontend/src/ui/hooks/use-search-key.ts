/** `/` goes to the search of a page, where nobody is typing. */
import { useEffect } from "react";
import { keyOf } from "../keys";

const TYPING = "input, textarea, select, [contenteditable=true], [role=dialog], [role=menu]";

export function useSearchKey(): void {
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (keyOf(event) !== "/" || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target instanceof Element && event.target.closest(TYPING) !== null) return;
      const field = document.querySelector<HTMLElement>("[data-search]");
      if (field === null) return;
      event.preventDefault();
      field.focus();
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
}
