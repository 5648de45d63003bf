/** Keeps what moves for as long as something runs in step, so that one drawing shows all of it. */
import { type RefObject, useEffect } from "react";

/**
 * Animations of an element that begin at their own times have the page painted at as many times in
 * each second, which a machine without a GPU has no time for. `on`: it moves now.
 */
export function useInStep(element: RefObject<Element | null>, on: boolean): void {
  useEffect(() => {
    if (!on) return;
    for (const animation of element.current?.getAnimations?.({ subtree: true }) ?? [])
      if (animation instanceof CSSAnimation) animation.startTime = 0;
  }, [element, on]);
}
