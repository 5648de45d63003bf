/** Marks the page's root while something of it is shown that takes room from all the rest. */
import { useLayoutEffect } from "react";

/** Sets an attribute at the root element while `on`; `:has()` there would be evaluated after every change of anything. */
export function useRootMark(name: `data-${string}`, on: boolean): void {
  useLayoutEffect(() => {
    if (!on) return;
    const { documentElement: root } = document;
    root.setAttribute(name, "");
    return () => root.removeAttribute(name);
  }, [name, on]);
}
