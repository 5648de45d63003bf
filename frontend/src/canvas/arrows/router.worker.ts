/** Routes lines in a web worker, so that the page never waits for them. */
import { routed, type Ways } from "./routes";
import type { Scene } from "./scene";
import type { RoutedLine } from "./simple-lines";

/** Differences from the previous report. */
export interface RouterReport {
  readonly changed: readonly RoutedLine[];
  readonly gone: readonly string[];
}

let ways: Ways = new Map();
let told = new Map<string, string>();

self.addEventListener("message", ({ data: scene }: MessageEvent<Scene>) => {
  const { lines, ways: known } = routed(scene, ways);
  ways = known;
  const now = new Map([...lines].map(([id, line]) => [id, JSON.stringify(line)]));
  const changed = [...lines.values()].filter(({ id }) => told.get(id) !== now.get(id));
  const gone = [...told.keys()].filter((id) => !now.has(id));
  told = now;
  self.postMessage({ changed, gone } satisfies RouterReport);
});
