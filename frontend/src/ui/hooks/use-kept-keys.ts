/** What of each graph somebody has folded or expanded: their own, kept on the device. */
import { useLocalStorage } from "@mantine/hooks";
import { useCallback, useMemo } from "react";

/** Keys by graph, the last one that was changed at the end. */
type KeptKeys = Readonly<Record<string, readonly string[]>>;

const MOST_GRAPHS = 200;
const NONE: ReadonlySet<string> = new Set();

/** What was kept for a graph; what has another shape is as if it were not there. */
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

/** `name`: of the place on the device. */
export function useKeptKeys(name: string, id: string) {
  const [kept, keep] = useLocalStorage<KeptKeys>({
    key: name,
    defaultValue: {},
    getInitialValueInEffect: false,
  });
  const put = useCallback(
    (keys: readonly string[], isIn: boolean) => keep((before) => withKept(before, id, keys, isIn)),
    [keep, id],
  );
  const keys = useMemo(() => keptIn(kept, id), [kept, id]);
  return useMemo(() => ({ keys, put }), [keys, put]);
}
