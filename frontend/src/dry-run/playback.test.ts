import { expect, test } from "vitest";
import * as Y from "yjs";
import type { TraceEvent } from "../api/dry-runs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setEntry, setExit } from "../graph/edit";
import { readGraph } from "../graph/read";
import { momentsOf, momentWords, playbackStateAt } from "./playback";
import { commandsOf, decide, NOTHING_DECIDED, scriptOf } from "./script";

const doc = new Y.Doc();
const a = addAction(doc, { name: "Look" });
const b = addAction(doc, { name: "Grip" });
setEntry(doc, a);
connect(doc, a, b);
setExit(doc, b);
const graph = { ...readGraph(mapsOf(doc)), name: "fetch" };

const at = (t_ms: number) => ({ t_ms, graph: "fetch" });
const state = (t: number, node: string, now: string): TraceEvent => ({
  ...at(t),
  kind: "node_state",
  node,
  state: now,
});
const trace: readonly TraceEvent[] = [
  { ...at(0), kind: "graph_state", state: "RUNNING" },
  { ...at(0), kind: "edge", edge: "GRAPH_ENTRY => Look_0", eval: "on_true -> run" },
  state(0, "Look_0", "INITIALIZED"),
  state(0, "Look_0", "RUNNING"),
  { ...at(1000), kind: "node_result", node: "Look_0", result: "on_true" },
  { ...at(1000), kind: "edge", edge: "Look_0 => Grip_0", eval: "on_true -> run" },
  state(1000, "Grip_0", "RUNNING"),
  state(1000, "Look_0", "FINISHED"),
  { ...at(1500), kind: "edge", edge: "odd", eval: "on_true -> ignore" },
  { ...at(2000), kind: "node_result", node: "Grip_0", result: "on_error", message: "slipped" },
  state(2000, "Grip_0", "ERROR"),
  { ...at(2000), kind: "graph_state", state: "HALTED" },
];

test("a moment is all that happens at one time, and only where something can be seen", () => {
  expect(momentsOf(trace)).toEqual([
    { at: 0, to: 4 },
    { at: 1000, to: 8 },
    { at: 2000, to: 12 },
  ]);
});

test("each moment shows what runs, how it ended, and says it in words", () => {
  const [first, second, third] = momentsOf(trace);
  const seen = playbackStateAt(trace, second?.to ?? 0, graph);
  expect(seen.running).toEqual([{ key: b, node: "Grip_0", call: 0, since: 1000 }]);
  expect(seen.progress.get(a)).toMatchObject({ tone: "true", word: "true", took: 1000 });
  expect(seen.progress.get(b)).toMatchObject({ tone: "run", word: "running", visits: 1 });
  expect(second && momentWords(trace, second, first?.to ?? 0)).toEqual([
    "Look_0 ends true",
    "Grip_0 runs",
  ]);
  expect(third && momentWords(trace, third, second?.to ?? 0)).toEqual([
    "Grip_0 ends with an error",
    "The graph halts: nothing runs and no exit was reached",
  ]);
});

test("a decision ends the visit right after it was made, and later ones are forgotten", () => {
  const look = { key: a, node: "Look_0", call: 0, since: 0 };
  const grip = { key: b, node: "Grip_0", call: 1, since: 1000 };
  const both = decide(decide(NOTHING_DECIDED, look, "on_false", 400), grip, "on_error", 1200);
  expect(scriptOf(both).behaviours).toEqual({
    Look_0: [{ after_s: 0.5, result: "on_false" }, {}],
    Grip_0: [{}, { after_s: 0.3, result: "on_error" }, {}],
  });
  const again = decide(both, look, "on_true", 200);
  expect(scriptOf(again).behaviours).toEqual({
    Look_0: [{ after_s: 0.3, result: "on_true" }, {}],
  });
});

test("a fault holds for every call that nobody decided; Stop is a command", () => {
  const never = { ...NOTHING_DECIDED, fault: { kind: "never", node: "Grip_0" } as const };
  expect(scriptOf(never).behaviours).toEqual({ Grip_0: [{ never: true }] });
  expect(commandsOf(never)).toEqual([]);
  const stopped = { ...NOTHING_DECIDED, fault: { kind: "stop", at: 700 } as const };
  expect(scriptOf(stopped).behaviours).toEqual({});
  expect(commandsOf(stopped)).toEqual([{ at_ms: 701, verb: "stop" }]);
});
