import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { relationId } from "../../graph/document-keys";
import { addAction, connect, moveActions, setEntry, setExit, setResponse } from "../../graph/edit";
import { changeNote, type Note, notesOf, writeNote } from "../../graph/edit/notes";
import { ENTRY, EXIT, type Graph, type Key, type Position } from "../../graph/model";
import type { Progress, Tone } from "../../status/progress";
import { graphIn } from "../../testing/edited-graph";
import { bundlesOf } from "../arrows/bundles";
import { edgesOf, type Folding, nodesOf, sceneOf, surroundingsOf } from "../elements";
import { positionsOf } from "../geometry/arrange";
import { notePlaces } from "../notes/note-nodes";
import {
  foldedArrows,
  foldedNodes,
  foldedScene,
  foldingOf,
  hiding,
  isInside,
  statesOf,
} from "./folding";

const NONE = new Set<string>();

const progressIn = (tone: Tone, word: string): Progress => ({
  ...{ tone, word, since: null, took: null, atMost: null },
  ...{ visits: 1, inferred: false, message: null },
});

const placesOf = (graph: Graph) => new Map([...positionsOf(graph), ...notePlaces(graph)]);

/** All that a canvas draws of a graph while these frames are folded. */
function drawn(graph: Graph, folded: ReadonlySet<string>, told: Partial<Told> = {}) {
  const places = placesOf(graph);
  const { progress = new Map(), marks = new Map() } = told;
  const options = { places, selected: NONE, progress, marks, measured: new Map() };
  const folding = foldingOf(graph, folded, places, new Map());
  const [nodes, edges, scene] = [
    nodesOf(graph, options),
    edgesOf(graph, options, surroundingsOf(graph, null)),
    sceneOf(graph, options, null),
  ];
  return {
    folding,
    whole: { nodes, edges, scene },
    nodes: foldedNodes(nodes, folding, graph, options),
    edges: foldedArrows(edges, folding),
    scene: foldedScene(scene, folding, places),
  };
}
type Told = Pick<Parameters<typeof nodesOf>[1], "progress" | "marks">;

const frameAt = (doc: Y.Doc, at: Position, size: Position, text = "") =>
  writeNote(doc, { kind: "frame", at, size, text, color: "blue" });

/** Look and Grip lie in a frame, Drive leads there, and Grip leads to Say. */
function gripping() {
  const doc = new Y.Doc();
  const at = (name: string, position: Position) => addAction(doc, { name, position });
  const [drive, look, grip, say] = [
    at("Drive", [0, 100]),
    at("Look", [400, 100]),
    at("Grip", [700, 100]),
    at("Say", [1200, 100]),
  ];
  setEntry(doc, drive);
  const into = connect(doc, drive, look, "on_true") ?? "";
  setResponse(doc, into, "on_false", "run");
  setResponse(doc, into, "on_error", "bypass");
  const within = connect(doc, look, grip, "on_true") ?? "";
  const out = connect(doc, grip, say, "on_true") ?? "";
  setExit(doc, say);
  moveActions(
    doc,
    new Map([
      [ENTRY, [-300, 100]],
      [EXIT, [1500, 100]],
    ] as [Key, Position][]),
  );
  const frame = frameAt(doc, [360, 40], [620, 300], "Gripping");
  return { doc, graph: graphIn(doc), drive, look, grip, say, frame, into, within, out };
}

test("a folded frame is one block in its place, and its contents are not drawn", () => {
  const { graph, frame, drive, look, grip, say } = gripping();
  const { nodes } = drawn(graph, new Set([frame]));
  const ids = nodes.map(({ id }) => id);
  expect(ids).toEqual(expect.arrayContaining([ENTRY, EXIT, drive, say, frame]));
  expect(ids).not.toEqual(expect.arrayContaining([look]));
  expect(ids).not.toEqual(expect.arrayContaining([grip]));
  expect(nodes.find(({ id }) => id === frame)).toMatchObject({
    ...{ type: "folded", position: { x: 360, y: 40 }, width: 620, height: 300 },
    ariaLabel: "Frame, blue, folded: Gripping. 2 actions",
    data: { block: { actions: 2, states: [], tone: null, mark: null } },
  });
});

test("arrows start or end at the block and keep their ids and their shared lines", () => {
  const { graph, frame, drive, say, into, out } = gripping();
  const { edges, scene } = drawn(graph, new Set([frame]));
  const ends = (id: string) =>
    edges.flatMap(({ source, target, data }) => (data?.relation === id ? [[source, target]] : []));
  expect(ends(into)).toEqual([
    [drive, frame],
    [drive, frame],
    [drive, frame],
  ]);
  expect(ends(out)).toEqual([[frame, say]]);
  expect(scene.lines.filter(({ id }) => id.startsWith(into))).toMatchObject([
    { source: drive, target: frame },
    { source: drive, target: frame },
  ]);
  expect(scene.cards.find(({ key }) => key === frame)).toMatchObject({ x: 360, width: 620 });
});

test("an arrow within the block is not drawn, nor one to an entry or exit on it", () => {
  const { doc, frame, look, within } = gripping();
  setEntry(doc, look);
  moveActions(doc, new Map([[ENTRY, [500, 250]]] as [Key, Position][]));
  const { nodes, edges } = drawn(graphIn(doc), new Set([frame]));
  expect(nodes.map(({ id }) => id)).toContain(ENTRY);
  expect(edges.map(({ data }) => data?.relation)).not.toContain(within);
  expect(edges.filter(({ source, target }) => source === ENTRY && target === frame)).toEqual([]);
});

test("only the visible end of an arrow can be moved", () => {
  const { graph, frame, into, out } = gripping();
  const { edges } = drawn(graph, new Set([frame]));
  const takes = (id: string) => edges.find(({ data }) => data?.relation === id)?.reconnectable;
  expect([takes(into), takes(out)]).toEqual(["source", "target"]);
});

test("a folded frame within a folded frame is not drawn", () => {
  const { doc, look, grip, frame } = gripping();
  const inner = frameAt(doc, [380, 60], [240, 200], "Looking");
  const graph = graphIn(doc);
  const { folding, nodes } = drawn(graph, new Set([frame, inner]));
  expect([...(folding?.blocks.keys() ?? [])]).toEqual([frame]);
  expect([look, grip, inner].map((key) => folding?.blockOf.get(key))).toEqual([
    frame,
    frame,
    frame,
  ]);
  expect(nodes.map(({ id }) => id)).not.toContain(inner);
  const seen = (keys: Key[]) => hiding(graph, new Set([frame, inner]), keys, placesOf(graph), NO);
  expect(seen([look]).sort()).toEqual([frame, inner].sort());
  expect(seen([grip])).toEqual([frame]);
  expect(seen([frame])).toEqual([]);
});
const NO = new Map();

test("states are counted by their words, the worst first, and unknown stays unknown", () => {
  const say = (...states: [Tone, string][]) =>
    statesOf(states.map(([tone, word]) => progressIn(tone, word))).map(
      ({ count, word, tone }) => `${count} ${word} (${tone})`,
    );
  expect(say(["true", "true"], ["run", "running"], ["true", "true"])).toEqual([
    "1 running (run)",
    "2 done (true)",
  ]);
  expect(say(["true", "true"], ["false", "false"], ["error", "error"])).toEqual([
    "1 error (error)",
    "2 done (done)",
  ]);
  expect(say(["run", "running"], ["unknown", "unknown"], ["idle", "waits"])).toEqual([
    "1 unknown (unknown)",
    "1 running (run)",
    "1 waiting (idle)",
  ]);
  expect(say(["stopped", "paused"], ["stopped", "stopped"])).toEqual([
    "1 paused (stopped)",
    "1 stopped (stopped)",
  ]);
});

test("a block has the states and problems of its contents only", () => {
  const { graph, frame, drive, look, within, into } = gripping();
  const mark = (wrong: number, reasons: string) => ({ wrong, fillIn: 1, warnings: 0, reasons });
  const progress = new Map([
    [drive, progressIn("error", "error")],
    [look, progressIn("run", "running")],
  ]);
  const marks = new Map([
    [look, mark(1, "A (1)\nB (2)")],
    [within, mark(2, "B (2)")],
    [into, mark(9, "C")],
  ]);
  const { nodes } = drawn(graph, new Set([frame]), { progress, marks });
  expect(nodes.find(({ id }) => id === frame)?.data).toMatchObject({
    block: {
      ...{ actions: 2, tone: "run", states: [{ word: "running", count: 1 }] },
      mark: { wrong: 3, fillIn: 2, reasons: "A (1)\nB (2)" },
    },
  });
});

const coordinate = fc.integer({ min: -400, max: 1200 });
const place = fc.tuple(coordinate, coordinate);
const graphs = fc.record({
  cards: fc.array(place, { minLength: 1, maxLength: 7 }),
  ends: fc.tuple(place, place),
  arrows: fc.array(fc.tuple(fc.nat(8), fc.nat(8), fc.constantFrom("run", "bypass" as const)), {
    maxLength: 14,
  }),
  frames: fc.array(
    fc.record({ at: place, size: fc.tuple(fc.integer({ min: 100, max: 1400 }), coordinate) }),
    { maxLength: 4 },
  ),
  folded: fc.array(fc.boolean(), { minLength: 4, maxLength: 4 }),
});

function made({ cards, ends, arrows, frames, folded }: Given): [Graph, Set<string>] {
  const doc = new Y.Doc();
  const keys = cards.map((position, i) => addAction(doc, { name: `A${i}`, position }));
  moveActions(
    doc,
    new Map([
      [ENTRY, ends[0]],
      [EXIT, ends[1]],
    ] as [Key, Position][]),
  );
  const all = [ENTRY, ...keys, EXIT];
  for (const [from, to, response] of arrows) {
    const [parent, child] = [all[from % all.length], all[to % all.length]];
    if (parent === undefined || child === undefined) continue;
    const relation = connect(doc, parent, child, "on_true");
    if (relation !== null && parent !== ENTRY) setResponse(doc, relation, "on_error", response);
  }
  const notes = frames.map(({ at, size: [width, height] }) =>
    frameAt(doc, at, [width, Math.abs(height) + 60]),
  );
  return [graphIn(doc), new Set(notes.filter((_, i) => folded[i]))];
}
type Given = typeof graphs extends fc.Arbitrary<infer T> ? T : never;

test("exactly the elements that are not hidden are drawn, and every other arrow lies within a block", () => {
  fc.assert(
    fc.property(graphs, (given) => {
      const [graph, folded] = made(given);
      const { folding, nodes, edges, scene, whole } = drawn(graph, folded);
      if (folding === null) return;
      const ids = new Set(nodes.map(({ id }) => id));
      for (const { id } of whole.nodes) expect(ids.has(id)).toBe(!folding.blockOf.has(id));
      for (const [key, block] of folding.blockOf) {
        expect([key, ids.has(key), ids.has(block)]).toEqual([key, false, true]);
      }
      const lines = new Map(scene.lines.map((line) => [line.id, line]));
      for (const relation of graph.relations) {
        const inside = isInside(folding, relation);
        for (const { id } of bundlesOf(relation)) expect(lines.has(id)).toBe(!inside);
        const drawnAs = edges.filter(({ data }) => data?.relation === relationId(relation));
        expect(drawnAs.length > 0).toBe(!inside);
        for (const { source, target } of drawnAs)
          expect(ids.has(source) && ids.has(target)).toBe(true);
      }
      const cards = new Set(scene.cards.map(({ key }) => key));
      for (const { source, target } of scene.lines)
        expect(cards.has(source) && cards.has(target)).toBe(true);
      expect(lines.size).toBe(scene.lines.length);
    }),
  );
});

test("without folded frames all elements are the same as without folding", () => {
  fc.assert(
    fc.property(graphs, (given) => {
      const [graph] = made(given);
      for (const folded of [NONE, new Set(["g/gone"])]) {
        const { folding, nodes, edges, scene, whole } = drawn(graph, folded);
        expect(folding).toBeNull();
        expect([nodes === whole.nodes, edges === whole.edges, scene === whole.scene]).toEqual([
          true,
          true,
          true,
        ]);
      }
    }),
  );
});

test("unfolding the frames that hide an element shows it, and unfolds no others", () => {
  fc.assert(
    fc.property(graphs, fc.nat(6), (given, which) => {
      const [graph, folded] = made(given);
      const places = placesOf(graph);
      const key = graph.actions[which % graph.actions.length]?.key ?? "";
      const opened = new Set(hiding(graph, folded, [key], places, NO));
      const rest = new Set([...folded].filter((frame) => !opened.has(frame)));
      const after: Folding | null = foldingOf(graph, rest, places, NO);
      expect(after?.blockOf.has(key) ?? false).toBe(false);
      const before = foldingOf(graph, folded, places, NO);
      if (!before?.blockOf.has(key)) expect(opened.size).toBe(0);
    }),
  );
});

test("a block that others move or resize is drawn at its new place", () => {
  const { doc, frame } = gripping();
  changeNote(doc, frame, { at: [340, 20], size: [700, 320] });
  const { scene } = drawn(graphIn(doc), new Set([frame]));
  expect(scene.cards.find(({ key }) => key === frame)).toMatchObject({
    ...{ x: 340, y: 20, width: 700, height: 320 },
  });
  expect(notesOf(graphIn(doc)).map(({ key }: Note) => key)).toEqual([frame]);
});
