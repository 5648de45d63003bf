import { expect, test } from "vitest";
import * as Y from "yjs";
import type { TraceEvent } from "../api/dry-runs";
import type { Run } from "../api/runs";
import { playbackStateAt } from "../dry-run/playback";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setEntry, setExit, setRequired } from "../graph/edit";
import type { Key } from "../graph/model";
import { readGraph } from "../graph/read";
import { lanesOf } from "./lanes/lanes";
import type { Progress, Tone } from "./progress";
import { needsIn, waitingFor, waitWords, withWaits } from "./waits";

/** Carrier drives; then Scout inspects, and Carrier reports when Scout and itself are done. */
function drawn() {
  const doc = new Y.Doc();
  const drive = addAction(doc, { name: "DriveTo", actor: "Carrier" });
  const inspect = addAction(doc, { name: "Inspect", actor: "Scout" });
  const report = addAction(doc, { name: "Report", actor: "Carrier" });
  setEntry(doc, drive);
  connect(doc, drive, inspect);
  connect(doc, drive, report);
  const arrow = connect(doc, inspect, report) ?? "";
  setExit(doc, report);
  return { doc, arrow, drive, inspect, report, graph: () => readGraph(mapsOf(doc)) };
}

const IDLE: Progress = {
  tone: "idle",
  word: "waits",
  since: null,
  took: null,
  atMost: null,
  visits: 0,
  inferred: false,
  message: null,
};
const is = (tone: Tone, word: string): Progress => ({ ...IDLE, tone, word });
const wordsOf = (progress: ReadonlyMap<Key, Progress>, ...keys: Key[]) =>
  keys.map((key) => progress.get(key)?.word);

test("an action says for whose action it waits while that one is next, and nothing before or after", () => {
  const { graph, drive, inspect, report } = drawn();
  const shown = (...tones: [Progress, Progress, Progress]) =>
    wordsOf(
      withWaits(
        graph(),
        new Map([drive, inspect, report].map((key, i) => [key, tones[i] ?? IDLE])),
      ),
      drive,
      inspect,
      report,
    );
  const [runs, ended] = [is("run", "running"), is("true", "true")];
  expect(shown(runs, IDLE, IDLE)).toEqual(["running", "waits for Carrier: DriveTo", "waits"]);
  expect(shown(ended, runs, IDLE)).toEqual(["true", "running", "waits for Scout: Inspect"]);
  // Inspect has not begun, and Report waits for nothing else.
  expect(shown(ended, IDLE, IDLE)[2]).toBe("waits for Scout: Inspect");
  expect(shown(ended, ended, IDLE)[2]).toBe("waits");
  // What is not known is not said, and what is over waits for nothing.
  expect(shown(is("unknown", "unknown"), IDLE, IDLE)[1]).toBe("waits");
  expect(shown(runs, is("idle", "did not run"), IDLE)[1]).toBe("did not run");
});

test("an optional arrow is not waited for", () => {
  const { doc, arrow, report, graph } = drawn();
  expect(needsIn(graph()).get(report)?.others).toHaveLength(1);
  setRequired(doc, arrow, false);
  expect(needsIn(graph()).has(report)).toBe(false);
});

test("unchanged progress stays the same object, so that no card is drawn again", () => {
  const { graph, drive, inspect } = drawn();
  const before = new Map([
    [drive, is("run", "running")],
    [inspect, IDLE],
  ]);
  const [one, two] = [withWaits(graph(), before), withWaits(graph(), before)];
  expect(one.get(inspect)).toBe(two.get(inspect));
  expect(one.get(drive)).toBe(before.get(drive));
  expect(waitingFor(IDLE, null)).toBe(IDLE);
  expect(withWaits(null, before)).toBe(before);
});

test("a dry-run says it at each moment", () => {
  const { graph, drive, inspect } = drawn();
  const shared = { ...graph(), name: "arrive" };
  const at = (t_ms: number) => ({ t_ms, graph: "arrive" });
  const trace: TraceEvent[] = [
    { ...at(0), kind: "graph_state", state: "RUNNING" },
    { ...at(0), kind: "node_state", node: "DriveTo_0", state: "RUNNING" },
    { ...at(1000), kind: "node_result", node: "DriveTo_0", result: "on_true" },
    { ...at(1000), kind: "node_state", node: "DriveTo_0", state: "FINISHED" },
    { ...at(1000), kind: "node_state", node: "Inspect_0", state: "RUNNING" },
  ];
  const shown = (to: number) => {
    const { progress } = playbackStateAt(trace, to, shared);
    return wordsOf(withWaits(shared, progress), drive, inspect);
  };
  expect(shown(2)).toEqual(["running", "waits for Carrier: DriveTo"]);
  expect(shown(5)).toEqual(["true", "running"]);
});

test("lanes know the needs of their actions, by the graph that was sent and by no other one", () => {
  const { graph } = drawn();
  const action = { aid: null, state: "", visits: [], older: 0, messages: [] };
  const run = {
    graph_name: "arrive",
    actions: { DriveTo_0: action, Inspect_0: action, Report_0: action },
  } as unknown as Run;
  const needs = (sent?: ReturnType<typeof graph> | null) =>
    Object.fromEntries(lanesOf(run, graph(), "", sent).map(({ name, needs }) => [name, needs]));
  expect(needs().Inspect_0).toEqual({
    parents: ["DriveTo_0"],
    others: [{ key: "DriveTo_0", words: "Carrier: DriveTo" }],
  });
  expect(needs(null).Inspect_0).toBeUndefined();
});

test("a name that turns its letters turns no word beside it", () => {
  const needs = { parents: ["a"], others: [{ key: "a", words: "\u2068\u202ex\u2069: Drive" }] };
  expect(waitWords(needs, () => "run")).toBe("waits for \u2068\u202ex\u2069: Drive");
});
