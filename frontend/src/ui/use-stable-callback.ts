/** Functions that stay the same, for what would draw again because of a new one. */
import { useCallback, useLayoutEffect, useRef } from "react";

/**
 * Return a function that stays the same object while the component is mounted, and calls the newest
 * callback.
 */
export function useStableCallback<A extends unknown[], R>(
  callback: (...given: A) => R,
): (...given: A) => R {
  const latest = useRef(callback);
  useLayoutEffect(() => {
    latest.current = callback;
  });
  return useCallback((...given: A) => latest.current(...given), []);
}
