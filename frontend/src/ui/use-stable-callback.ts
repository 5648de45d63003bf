/** Functions that stay the same, for what would draw again because of a new one. */
import { useCallback, useLayoutEffect, useRef } from "react";

/** The same function as long as the component is there. It does what the last one given does. */
export function useStableCallback<A extends unknown[], R>(
  callback: (...given: A) => R,
): (...given: A) => R {
  const latest = useRef(callback);
  useLayoutEffect(() => {
    latest.current = callback;
  });
  return useCallback((...given: A) => latest.current(...given), []);
}
