/** The states of what runs inside of an action, in a dry-run or a run. */
import { useMemo, useSyncExternalStore } from "react";
import type { DryRun } from "../../dry-run/use-dry-run";
import { useEditorContext } from "../../edit-actions/editor-context";
import { fullName, type Key } from "../../graph/model";
import type { Progress } from "../../status/progress";
import { progressBelow, type RunOnCanvas, runOnCanvas } from "../../status/progress-inside";
import type { LevelGraph } from "./level-graph";

const NOTHING: ReadonlyMap<Key, Progress> = new Map();

/** How an engine calls it: `OUTER__INNER__0` (docs/umrf-and-the-engine.md 2.6). */
const calledBy = (outermost: string, { names }: LevelGraph): string =>
  [outermost, ...names.flatMap(({ name, instanceId }) => [name, String(instanceId)])].join("__");

/** From where states are known. */
export interface StateSource {
  readonly dryRun: Pick<DryRun, "inside"> | null;
  readonly run: RunOnCanvas | null;
  /** The name of the graph on the canvas. */
  readonly outermost: string;
}

export function progressOf(
  level: LevelGraph,
  { dryRun, run, outermost }: StateSource,
): ReadonlyMap<Key, Progress> {
  const { graph } = level;
  if (graph === null || typeof graph === "string") return NOTHING;
  if (dryRun) return dryRun.inside({ ...graph, name: calledBy(outermost, level) });
  return run ? progressBelow(run, graph, level.names.map(fullName)) : NOTHING;
}

export function useLevelProgress(level: LevelGraph): ReadonlyMap<Key, Progress> {
  const { dryRun, graph } = useEditorContext();
  const { name: outermost } = graph;
  const run = useSyncExternalStore(runOnCanvas.subscribe, runOnCanvas.now);
  return useMemo(
    () => progressOf(level, { dryRun, run, outermost }),
    [level, dryRun, run, outermost],
  );
}
