/** What a copy of a moment is called. Pure. */

/** "valves v11", "valves v11 2" …: the first that no graph is called. */
export function copyNameOf(graph: string, version: string, taken: readonly string[]): string {
  const stem = `${graph || "untitled"} ${version}`.trim();
  for (let n = 1; ; n += 1) {
    const next = n === 1 ? stem : `${stem} ${n}`;
    if (!taken.includes(next)) return next;
  }
}
