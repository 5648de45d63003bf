/**
 * Hooks about the device (the size of its screen, its search key, and what it keeps for its person), and stable
 * callbacks.
 */
import { useLocalStorage, useMediaQuery } from "@mantine/hooks";
import { useCallback, useEffect, useLayoutEffect, useMemo, useRef } from "react";
import { keyOf } from "./keys";

const AT_ONCE = { getInitialValueInEffect: false };

/** Return whether there is room for the list, the canvas and the details side by side. */
export function useIsWide(): boolean {
  return useMediaQuery("(min-width: 1101px)", true, AT_ONCE);
}

/** Return whether the screen is that of a phone, which shows one thing at a time. */
export function useIsPhone(): boolean {
  return useMediaQuery("(max-width: 600px)", false, AT_ONCE);
}

/** Return whether fingers are the only pointer: there is no mouse, and most likely no keyboard. */
export function useHasFingersOnly(): boolean {
  return useMediaQuery("(pointer: coarse) and (hover: none)", false, AT_ONCE);
}

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

/** A value that this device keeps for its person. It is there at the first rendering. */
export function useKept<T>(key: string, defaultValue: T) {
  return useLocalStorage<T>({ key, defaultValue, ...AT_ONCE });
}

export type ListTab = "graphs" | "actions";

export function useListTab() {
  return useKept<ListTab>("aa.list-tab", "graphs");
}

/** Keys by graph, the last one that was changed at the end. */
type KeptKeys = Readonly<Record<string, readonly string[]>>;

const MOST_GRAPHS = 200;
const NONE: ReadonlySet<string> = new Set();

/** Return the keys kept for a graph; an empty set if the stored value has another shape. */
export function keptIn(kept: unknown, id: string): ReadonlySet<string> {
  const found: unknown =
    typeof kept === "object" && kept !== null ? (kept as Record<string, unknown>)[id] : undefined;
  if (!Array.isArray(found) || found.length === 0) return NONE;
  return new Set(found.filter((key): key is string => typeof key === "string"));
}

export function withKept(
  kept: unknown,
  id: string,
  keys: readonly string[],
  isIn: boolean,
): KeptKeys {
  const next = new Set(keptIn(kept, id));
  for (const key of keys) {
    if (isIn) next.add(key);
    else next.delete(key);
  }
  const others = Object.entries(typeof kept === "object" && kept !== null ? kept : {})
    .filter(([graph]) => graph !== id)
    .slice(1 - MOST_GRAPHS);
  return Object.fromEntries(next.size > 0 ? [...others, [id, [...next]]] : others);
}

/** Keeps a set of keys on this device, under `id` in the place `name`. */
export function useKeptKeys(name: string, id: string) {
  const [kept, keep] = useKept<KeptKeys>(name, {});
  const put = useCallback(
    (keys: readonly string[], isIn: boolean) => keep((before) => withKept(before, id, keys, isIn)),
    [keep, id],
  );
  const keys = useMemo(() => keptIn(kept, id), [kept, id]);
  return useMemo(() => ({ keys, put }), [keys, put]);
}

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
