import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import type { Run, Visit } from "../api/runs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setEntry } from "../graph/edit";
import { readGraph } from "../graph/read";
import { keysByName, type PlaybackState } from "./playback";
import { decide, decidedBy, rewritesRun, scriptOf } from "./script";
import { seededMoment, withRecordedValues } from "./seed";
import { seedOf, visitAt } from "./seed-of-run";

const doc = new Y.Doc();
const look = addAction(doc, { name: "Look" });
const grip = addAction(doc, { name: "Grip" });
setEntry(doc, look);
connect(doc, look, grip);
const graph = { ...readGraph(mapsOf(doc)), name: "fetch" };

const iso = (s: number) => new Date(1_000_000 + s * 1000).toISOString();
const at = (s: number) => 1_000_000 + s * 1000;

/** Seen exactly unless `most` says until when it may have gone on. */
const visit = (from: number, until: number | null, part: Partial<Visit> = {}): Visit => ({
  from: iso(from),
  not_before: iso(from),
  until: until === null ? null : iso(until),
  not_after: until === null ? null : iso(until),
  result: until === null ? null : "true",
  how: "observed",
  inputs: null,
  ...part,
});

const ran = (actions: Record<string, [string | null, Visit[]]>): Run =>
  ({
    id: "r",
    number: 7,
    started_at: iso(0),
    requested_at: iso(0),
    actions: Object.fromEntries(
      Object.entries(actions).map(([name, [aid, visits]]) => [
        name,
        { aid, state: "FINISHED", visits, older: 0, messages: [] },
      ]),
    ),
  }) as unknown as Run;

const run = ran({
  Look_0: [look, [visit(0, 2, { inputs: { place: '"door"' } })]],
  Grip_0: [grip, [visit(2, 6, { result: "error" })]],
});

test("what had ended is played as it went, and what went on waits for a decision", () => {
  const seed = seedOf(run, graph, 0, at(4));
  expect(seed.at).toBe(4_000);
  expect(scriptOf(decidedBy(seed)).behaviours).toEqual({
    Look_0: [{ after_s: 2, result: "on_true" }, {}],
    Grip_0: [{ never: true }, {}],
  });
  expect(seed.ends.get("Grip_0")).toBe("error");
  expect(seed.values).toEqual([{ node: "Look_0", name: "place", text: '"door"' }]);
});

test("what is played again has the values of the run, and nothing else has any", () => {
  const loops = ran({
    Look_0: [
      look,
      [
        visit(0, 1, { inputs: { place: '"door"' } }),
        visit(2, 3),
        visit(4, 5, { inputs: { place: '"shelf"' } }),
        visit(8, 9, { inputs: { place: '"dock"' } }),
      ],
    ],
  });
  const seed = seedOf(loops, graph, 0, at(6));
  const keys = keysByName(graph);
  const shown = (visits: number) => {
    const { progress } = withRecordedValues(state({ [look]: visits }, []), seed, keys);
    return progress.get(look)?.inputs;
  };
  expect([0, 1, 2, 3, 4].map(shown)).toEqual([
    undefined,
    { place: '"door"' },
    undefined,
    { place: '"shelf"' },
    undefined,
  ]);
  const going = (call: number) => ({ key: look, node: "Look_0", call, since: 0 });
  const rewrites = (call: number) =>
    rewritesRun(decide(decidedBy(seed), going(call), "on_true", 0), seed);
  expect([rewrites(2), rewrites(3)]).toEqual([true, false]);
});

test("what is not known of the moment says so, and nothing of it is hidden", () => {
  const vague = ran({
    Look_0: [look, [visit(0, 2, { not_after: iso(5), result: null })]],
    Gone_0: ["gone", [visit(2, 3)]],
    "Sub/Pick_0": [null, [visit(2, 3)]],
  });
  const texts = seedOf(vague, graph, 2, at(4)).doubts.map(({ node, text }) => `${node}: ${text}`);
  expect(texts).toContain("Look_0: may have ended by then: the exact time was not seen");
  expect(texts).toContain("Gone_0: ran, and is not in this graph any more");
  expect(texts).toContain("Sub/Pick_0: belongs to a sub-graph, which the dry-run plays as usual");
  expect(texts).toContain(
    ": The graph on screen differs from the one that ran in 2 places; the dry-run plays the one on screen",
  );
  expect(texts.some((text) => text.includes("The values of 1 of 1 actions were not seen"))).toBe(
    true,
  );
});

test("a duration that is known as a range is played as its middle, and told as a range", () => {
  const range = ran({ Look_0: [look, [visit(0, 2, { not_after: iso(3) })]] });
  const seed = seedOf(range, graph, 0, at(9));
  expect(seed.behaviours.Look_0).toEqual([{ after_s: 2.5, result: "on_true" }]);
  expect(seed.doubts.map(({ text }) => text)).toContain("took 2.0–3.0 s; the dry-run takes 2.5 s");
});

test("a visit is only surely over, or surely not begun, outside of all its bounds", () => {
  const times = fc.array(fc.nat(36), { minLength: 4, maxLength: 4 });
  fc.assert(
    fc.property(times, fc.nat(40), (gaps, now) => {
      const [a = 0, b = 0, c = 0, d = 0] = gaps.toSorted((one, other) => one - other);
      const bounds = { not_before: iso(a), not_after: iso(d) };
      const { state, sure } = visitAt(visit(b, c, bounds), at(now));
      if (sure && state === "ended") expect(now).toBeGreaterThanOrEqual(d);
      if (sure && state === "not begun") expect(now).toBeLessThan(a);
      if (sure && state === "goes on") expect(now).toBeLessThan(c);
    }),
  );
});

const state = (visits: Record<string, number>, running: string[]): PlaybackState => ({
  progress: new Map(
    Object.entries(visits).map(([key, count]) => [key, { visits: count } as never]),
  ),
  running: running.map((node) => ({ key: "", node, call: 0, since: 0 })),
  state: "RUNNING",
});

test("a dry-run begins where the rules have led to the same; what they lead elsewhere is told", () => {
  const seed = seedOf(run, graph, 0, at(4));
  const keys = keysByName(graph);
  const states = [
    state({ [look]: 1 }, ["Look_0"]),
    state({ [look]: 1, [grip]: 1 }, ["Grip_0"]),
    state({ [look]: 1, [grip]: 1 }, []),
  ];
  expect(seededMoment(seed, states, keys)).toEqual({ index: 1, doubts: [] });
  const never = seededMoment(seed, [state({ [look]: 1 }, [])], keys);
  expect(never.doubts).toEqual([
    { node: "Grip_0", text: "in the run: begun 1×, going on; by the engine’s rules: not run" },
  ]);
});
