import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import {
  addAction,
  connect,
  moveActions,
  setEntry,
  setExit,
  setField,
  setResponse,
} from "../graph/edit";
import { meaning } from "../graph/meaning";
import { ENTRY, EXIT, type Graph } from "../graph/model";
import { readGraph } from "../graph/read";
import type { Progress } from "../status/progress";
import {
  edgesOf,
  keepEqual,
  type NodeOptions,
  nodesOf,
  responsesOf,
  sceneOf,
  surroundingsOf,
} from "./elements";
import { fromUmrf } from "./from-umrf";
import { arrange, positionsOf, unplaced } from "./geometry/arrange";

function drawn(): { graph: Graph; doc: Y.Doc; a: string; b: string } {
  const doc = new Y.Doc();
  const a = addAction(doc, {
    name: "Check",
    inputs: [{ path: "min", text: '{"pvf_type": "number", "pvf_value": 5.0}' }],
  });
  const b = addAction(doc, { name: "Drive" });
  setEntry(doc, a);
  const arrow = connect(doc, a, b, "on_true") ?? "";
  setResponse(doc, arrow, "on_false", "run");
  setResponse(doc, arrow, "on_error", "bypass");
  setExit(doc, b);
  return { graph: readGraph(mapsOf(doc)), doc, a, b };
}

const options = (graph: Graph): NodeOptions => ({
  places: positionsOf(graph),
  selected: new Set(),
  progress: new Map(),
  marks: new Map(),
  measured: new Map(),
});

test("each outcome with a response has its own arrow from its own handle", () => {
  const { graph, a, b } = drawn();
  const around = surroundingsOf(graph, null);
  const arrows = edgesOf(graph, options(graph), around).filter((edge) => edge.source === a);
  expect(arrows.map((edge) => [edge.sourceHandle, edge.target])).toEqual([
    ["on_true", b],
    ["on_false", b],
    ["on_error", b],
  ]);
  expect(arrows.map((edge) => edge.data?.answers !== null)).toEqual([true, false, false]);
});

test("an arrow is a ghost where only the run that is compared went that way", () => {
  const { graph, a } = drawn();
  const around = surroundingsOf(graph, null);
  const progress = new Map([[a, { tone: "true" } as Progress]]);
  const ghostsOf = (end: string) =>
    edgesOf(graph, { ...options(graph), progress, ghosts: new Map([[a, end]]) }, around)
      .filter((edge) => edge.source === a)
      .map((edge) => [edge.data?.came, edge.data?.ghost ?? false]);
  expect(ghostsOf("error")).toEqual([
    ["on_true", false],
    ["on_true", false],
    [null, true],
  ]);
  expect(ghostsOf("false").every(([, ghost]) => ghost === false)).toBe(true);
});

test("outcomes with the same response share a pill", () => {
  const { graph, a } = drawn();
  const relation = graph.relations.find(({ parent }) => parent === a);
  expect(relation && responsesOf(relation)).toEqual([
    { outcomes: ["on_true", "on_false"], response: "run" },
    { outcomes: ["on_error"], response: "bypass" },
  ]);
});

test("unchanged elements keep their identity", () => {
  const { graph, doc, a } = drawn();
  const before = nodesOf(graph, options(graph));
  expect(keepEqual(before, nodesOf(graph, options(graph)))).toBe(before);
  moveActions(doc, unplaced(graph, positionsOf(graph)));
  addAction(doc, { name: "Third", position: [900, 900] });
  const next = readGraph(mapsOf(doc));
  const after = keepEqual(before, nodesOf(next, options(next)));
  expect(after).not.toBe(before);
  const card = (nodes: typeof before) => nodes.find(({ id }) => id === a);
  expect(card(after)?.position).toEqual(card(before)?.position);
});

test("lines lead to cards of the rendered size, also before these are measured", () => {
  const { graph } = drawn();
  for (const direction of ["right", "down"] as const) {
    const turned: Graph = { ...graph, direction };
    const nodes = nodesOf(turned, options(turned)).filter(({ type }) => type === "action");
    const { cards } = sceneOf(turned, options(turned), null);
    for (const { id, measured } of nodes)
      expect(cards.find(({ key }) => key === id)).toMatchObject(measured ?? {});
  }
});

test("a graph without places is arranged from the entry down to the exit", () => {
  const { graph, a, b } = drawn();
  const places = arrange(graph);
  const y = (key: string) => places.get(key)?.[1] ?? Number.NaN;
  expect([y(ENTRY) < y(a), y(a) < y(b), y(b) < y(EXIT)]).toEqual([true, true, true]);
});

test("elements keep their place when an element without one is added", () => {
  const { graph, a } = drawn();
  const placed: Graph = {
    ...graph,
    actions: graph.actions.map((action) =>
      action.key === a ? { ...action, position: [1000, 500] as const } : action,
    ),
  };
  const places = positionsOf(placed);
  expect(places.get(a)).toEqual([1000, 500]);
  expect(places.get(ENTRY)?.[1]).toBeLessThan(500);
});

const umrf = {
  graph_name: "",
  graph_entry: [{ name: "Check", instance_id: 0 }],
  graph_exit: [
    {
      name: "Drive",
      instance_id: 0,
      conditions: [
        "on_true -> run",
        "on_false->ignore",
        "on_error -> ignore",
        "on_stopped -> ignore",
      ],
    },
  ],
  actions: [
    { name: "Drive", instance_id: 0, type: "sync", parents: [parent()] },
    {
      name: "Check",
      instance_id: 0,
      type: "sync",
      input_parameters: { min: { pvf_type: "number", pvf_value: 5 } },
      children: [{ name: "Drive", instance_id: 0 }],
    },
  ],
};

function parent() {
  const conditions = ["on_true -> run", "on_false -> run", "on_error -> bypass"];
  return { name: "Check", instance_id: 0, required: true, conditions };
}

test("a version read from UMRF equals the graph that it was made of", () => {
  const { graph, doc, b } = drawn();
  expect(meaning(fromUmrf(umrf))).toBe(meaning(graph));
  connect(doc, b, EXIT, "on_error");
  expect(meaning(fromUmrf(umrf))).not.toBe(meaning(readGraph(mapsOf(doc))));
});

test("UMRF that is no graph is drawn as an empty graph", () => {
  for (const odd of [null, 5, [], { actions: [null, 7] }, { graph_entry: "x", actions: {} }]) {
    expect(() => fromUmrf(odd)).not.toThrow();
  }
});

test("robots are named on cards and arrows only where a graph has several", () => {
  const doc = new Y.Doc();
  const a = addAction(doc, { name: "DriveTo", actor: "Carrier" });
  const b = addAction(doc, { name: "Inspect" });
  connect(doc, a, b, "on_true");
  const shown = () => {
    const graph = readGraph(mapsOf(doc));
    const cards = nodesOf(graph, options(graph)).filter((node) => node.type === "action");
    const [arrow] = edgesOf(graph, options(graph), surroundingsOf(graph, null));
    const [line] = sceneOf(graph, options(graph), null).lines;
    return { cards, arrow, width: line?.pill?.width ?? 0 };
  };
  const alone = shown();
  expect(alone.cards.map(({ data }) => data.robot)).toEqual(["", ""]);
  expect(alone.arrow?.data?.hand).toBeNull();
  setField(doc, b, "actor", "Scout");
  const both = shown();
  expect(new Set(both.cards.map(({ ariaLabel }) => ariaLabel))).toEqual(
    new Set(["DriveTo 0, robot Carrier", "Inspect 0, robot Scout"]),
  );
  expect(both.arrow?.data?.hand).toEqual({ from: "Carrier", to: "Scout", waits: true });
  expect(both.arrow?.ariaLabel).toBe(
    "Arrow from DriveTo 0, when true: run Inspect 0; Scout waits for Carrier",
  );
  expect(both.width).toBeGreaterThan(alone.width);
});
