import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import {
  type Breakpoint,
  breakpointsIn,
  breakpointText,
  ENDS,
  PLAIN,
  readBreakpoint,
  runMarks,
  startBreakpoints,
  TESTS,
  whyNoBreakpoint,
} from "./breakpoints";
import { mapsOf, relationId } from "./document-keys";
import { addAction, connect, removeActions, retarget, setExit, setResponse, undoOf } from "./edit";
import { setBreakpoint } from "./edit/breakpoints";
import { clipOf, paste } from "./edit/clip";
import { readGraph } from "./read";

function drawn() {
  const doc = new Y.Doc();
  const lift = addAction(doc, { name: "Lift" });
  const scan = addAction(doc, { name: "Scan" });
  const halt = addAction(doc, { name: "Halt" });
  const on = connect(doc, lift, scan, "on_true") ?? "";
  const stop = connect(doc, lift, halt, "on_false") ?? "";
  setResponse(doc, stop, "on_false", "stop");
  setExit(doc, scan);
  return { doc, lift, scan, halt, on, stop, graph: () => readGraph(mapsOf(doc)) };
}

const rules: fc.Arbitrary<Breakpoint> = fc.record({
  visit: fc.nat(1_000_000),
  outcomes: fc.subarray([...ENDS]),
  value: fc.option(
    fc.record({
      name: fc.string({ minLength: 1 }),
      test: fc.constantFrom(...TESTS),
      value: fc.oneof(fc.boolean(), fc.string(), fc.integer()),
    }),
  ),
});

test("a breakpoint is read as it was written", () => {
  fc.assert(
    fc.property(rules, (rule) => {
      expect(readBreakpoint(breakpointText(rule))).toEqual(rule);
    }),
  );
});

test("a text that says no breakpoint is none, and stays", () => {
  const { doc, lift, graph } = drawn();
  for (const text of ["[]", "5", '{"visit":-1}', '{"outcomes":["stopped"]}', '{"value":{}}']) {
    doc.getMap("actions").set(`${lift}|breakpoint`, text);
    expect(breakpointsIn(graph()).size).toBe(0);
    expect(doc.getMap("actions").get(`${lift}|breakpoint`)).toBe(text);
  }
});

test("no run waits before a stop", () => {
  const { doc, stop, on, graph } = drawn();
  setBreakpoint(doc, stop, PLAIN);
  setBreakpoint(doc, on, PLAIN);
  const arrow = graph().relations.find((each) => relationId(each) === stop);
  expect(arrow && whyNoBreakpoint(arrow)).toContain("A stop always passes");
  expect(startBreakpoints(graph())).toEqual([{ action: "Lift_0", to: "Scan_0" }]);
});

test("a copy has the breakpoints of what was copied, and the original keeps its own", () => {
  const { doc, lift, scan, on, graph } = drawn();
  setBreakpoint(doc, lift, { ...PLAIN, visit: 7 });
  setBreakpoint(doc, on, PLAIN);
  paste(doc, clipOf(doc, new Set([lift, scan]), new Map()), { by: [40, 40] });
  expect(startBreakpoints(graph())).toEqual([
    { action: "Lift_0", visit: 7 },
    { action: "Lift_1", visit: 7 },
    ...startBreakpoints(graph()).slice(2),
  ]);
  expect(startBreakpoints(graph())).toHaveLength(4);
});

test("an arrow that leads elsewhere takes its breakpoint along", () => {
  const { doc, on, graph } = drawn();
  const park = addAction(doc, { name: "Park" });
  setBreakpoint(doc, on, PLAIN);
  retarget(doc, on, "on_true", { child: park });
  expect([...breakpointsIn(graph()).keys()]).toEqual([expect.stringContaining(`>${park}`)]);
});

test("undo takes back one's own breakpoint, and brings one back with its action", () => {
  const { doc, lift, graph } = drawn();
  const undo = undoOf(doc);
  setBreakpoint(doc, lift, PLAIN);
  removeActions(doc, [lift]);
  expect(breakpointsIn(graph()).size).toBe(0);
  undo.undo();
  expect(breakpointsIn(graph()).size).toBe(1);
  undo.undo();
  expect(breakpointsIn(graph()).size).toBe(0);
  undo.redo();
  expect(breakpointsIn(graph()).size).toBe(1);
});

test("the breakpoints of a run stand at the places from which they came", () => {
  const { doc, lift, on, graph } = drawn();
  setBreakpoint(doc, lift, { ...PLAIN, visit: 2 });
  setBreakpoint(doc, on, PLAIN);
  const sent = startBreakpoints(graph()).map((each) =>
    each.to ? { ...each, outcomes: ["true" as const] } : each,
  );
  expect(runMarks(graph(), sent)).toEqual(
    new Map([
      [lift, "A led run waits before this: visit 2"],
      [on, "A led run waits here"],
    ]),
  );
});

const EDITS = ["set", "clear", "remove", "undo", "redo", "merge"] as const;

test("however two people edit, both see the same breakpoints, and no more than they set", () => {
  fc.assert(
    fc.property(
      fc.array(fc.tuple(fc.boolean(), fc.constantFrom(...EDITS), fc.nat(4)), { maxLength: 25 }),
      (steps) => {
        const first = drawn();
        const other = new Y.Doc();
        const merge = () => {
          Y.applyUpdate(other, Y.encodeStateAsUpdate(first.doc));
          Y.applyUpdate(first.doc, Y.encodeStateAsUpdate(other));
        };
        merge();
        const docs = [first.doc, other].map((doc) => ({ doc, undo: undoOf(doc) }));
        const places = [first.lift, first.scan, first.halt, first.on, first.stop];
        const wasSet = new Set<string>();
        for (const [isFirst, edit, place] of steps) {
          const { doc, undo } = docs[isFirst ? 0 : 1] as (typeof docs)[number];
          const id = places[place] as string;
          if (edit === "set" && setBreakpoint(doc, id, PLAIN)) wasSet.add(id);
          else if (edit === "clear") setBreakpoint(doc, id, null);
          else if (edit === "remove" && place < 3) removeActions(doc, [id]);
          else if (edit === "undo") undo.undo();
          else if (edit === "redo") undo.redo();
          else merge();
        }
        merge();
        const [a, b] = docs.map(({ doc }) => breakpointsIn(readGraph(mapsOf(doc))));
        expect(a).toEqual(b);
        for (const id of a?.keys() ?? []) expect(wasSet).toContain(id);
      },
    ),
    { numRuns: 60 },
  );
});
