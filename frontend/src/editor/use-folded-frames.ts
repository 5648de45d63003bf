/** Which frames of a graph are folded: each person's own, kept on the device. */
import { useLocalStorage } from "@mantine/hooks";
import { useCallback, useMemo } from "react";

/** Keys of frames by graph, the last one that was changed at the end. */
type FoldedFrames = Readonly<Record<string, readonly string[]>>;

const MOST_GRAPHS = 200;
const NONE: ReadonlySet<string> = new Set();

/** What was kept for a graph; what has another shape is as if it were not there. */
export function foldedIn(kept: unknown, id: string): ReadonlySet<string> {
  const found: unknown =
    typeof kept === "object" && kept !== null ? (kept as Record<string, unknown>)[id] : undefined;
  if (!Array.isArray(found) || found.length === 0) return NONE;
  return new Set(found.filter((key): key is string => typeof key === "string"));
}

export function withFolded(
  kept: unknown,
  id: string,
  frames: readonly string[],
  folded: boolean,
): FoldedFrames {
  const next = new Set(foldedIn(kept, id));
  for (const key of frames) {
    if (folded) next.add(key);
    else next.delete(key);
  }
  const others = Object.entries(typeof kept === "object" && kept !== null ? kept : {})
    .filter(([graph]) => graph !== id)
    .slice(1 - MOST_GRAPHS);
  return Object.fromEntries(next.size > 0 ? [...others, [id, [...next]]] : others);
}

export function useFoldedFrames(id: string) {
  const [kept, keep] = useLocalStorage<FoldedFrames>({
    key: "aa.folded",
    defaultValue: {},
    getInitialValueInEffect: false,
  });
  const fold = useCallback(
    (frames: readonly string[], folded: boolean) =>
      keep((before) => withFolded(before, id, frames, folded)),
    [keep, id],
  );
  const now = useMemo(() => foldedIn(kept, id), [kept, id]);
  return useMemo(() => ({ folded: now, fold }), [now, fold]);
}
