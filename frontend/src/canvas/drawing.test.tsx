// @vitest-environment jsdom
import { ReactFlowProvider } from "@xyflow/react";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { addAction, connect, moveActions, rename } from "../graph/edit";
import type { Graph } from "../graph/model";
import { followGraph } from "../graph/read";
import { ActionCard } from "./action-card";
import {
  type Arrow,
  type CanvasNode,
  type CardNode,
  type CardSurroundings,
  edgesOf,
  keepEqual,
  nodesOf,
  surroundingsOf,
} from "./elements";
import { positionsOf } from "./geometry/arrange";

const ACTIONS = 200;

/** The actions whose cards React rendered: each card asks once for the comments about its action. */
const { rendered } = vi.hoisted(() => ({ rendered: [] as string[] }));
vi.mock("./editor-store", async (original) => {
  const real = await original<typeof import("./editor-store")>();
  const useOpenThreadCount = (key: string) => {
    rendered.push(key);
    return real.useOpenThreadCount(key);
  };
  return { ...real, useOpenThreadCount };
});

let root: Root;
let nodes: CanvasNode[];

beforeEach(() => {
  vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
  root = createRoot(document.createElement("div"));
  nodes = [];
});

afterEach(() => {
  act(() => root.unmount());
  vi.unstubAllGlobals();
});

/** What the canvas hands to a card: everything of its node that a card may look at. */
function propsOf({ id, data, selected }: CardNode) {
  const fixed = { type: "action", dragging: false, zIndex: 0, draggable: true } as const;
  const rest = { selectable: true, deletable: true, isConnectable: true } as const;
  const place = { positionAbsoluteX: 0, positionAbsoluteY: 0 };
  return { ...fixed, ...rest, ...place, id, data, selected: selected ?? false };
}

/** Draws the cards of a graph, and notes which of them React renders. */
function draw(graph: Graph, others: ReadonlyMap<string, string> = new Map()): string[] {
  const options = { places: positionsOf(graph), selected: new Set<string>(), others };
  const none = { progress: new Map(), marks: new Map(), measured: new Map() };
  nodes = keepEqual(nodes, nodesOf(graph, { ...options, ...none }, nodes));
  rendered.length = 0;
  act(() =>
    root.render(
      <ReactFlowProvider>
        {nodes.flatMap((node) =>
          node.type === "action" ? <ActionCard key={node.id} {...propsOf(node)} /> : [],
        )}
      </ReactFlowProvider>,
    ),
  );
  return [...rendered];
}

test("of two hundred actions only the changed ones are rendered again", {
  timeout: 60_000,
}, () => {
  const doc = new Y.Doc();
  const source = followGraph(doc);
  const keys = doc.transact(() =>
    Array.from({ length: ACTIONS }, (_, n) =>
      addAction(doc, { name: `Action ${n}`, position: [(n % 40) * 260, Math.floor(n / 40) * 160] }),
    ),
  );
  const [first = "", second = "", third = ""] = keys;
  expect(draw(source.graph()).length).toBe(ACTIONS);
  expect(draw(source.graph())).toEqual([]);

  rename(doc, first, "Renamed");
  expect(draw(source.graph())).toEqual([first]);

  moveActions(doc, [[second, [10, 20]]]);
  expect(draw(source.graph())).toEqual([second]);

  expect(draw(source.graph(), new Map([[third, "#2563eb"]]))).toEqual([third]);
});

/** The elements of `next` that are not the same objects as before. */
function fresh<T extends { readonly id: string }>(before: readonly T[], next: readonly T[]) {
  const known = new Set(before);
  return next.filter((item) => !known.has(item)).map(({ id }) => id);
}

test("of two hundred cards and their arrows only the changed ones get new objects", () => {
  const doc = new Y.Doc();
  const source = followGraph(doc);
  const keys = doc.transact(() => {
    const keys = Array.from({ length: ACTIONS }, (_, n) =>
      addAction(doc, { name: `Action ${n}`, position: [(n % 40) * 260, Math.floor(n / 40) * 160] }),
    );
    for (let n = 40; n < ACTIONS; n += 1) connect(doc, keys[n - 40] ?? "", keys[n] ?? "");
    return keys;
  });
  const made = (before: {
    nodes: CanvasNode[];
    edges: Arrow[];
    around: CardSurroundings | null;
  }) => {
    const graph = source.graph();
    const options = {
      ...{ places: positionsOf(graph), selected: new Set<string>() },
      ...{ progress: new Map(), marks: new Map(), measured: new Map() },
    };
    const around = surroundingsOf(graph, before.around);
    return {
      nodes: nodesOf(graph, options, before.nodes),
      edges: keepEqual(before.edges, edgesOf(graph, options, around)),
      around,
    };
  };
  const first = made({ nodes: [], edges: [], around: null });
  expect(first.edges.length).toBe(ACTIONS - 40);
  const [one = "", other = ""] = keys;

  moveActions(doc, [[one, [10, 20]]]);
  const moved = made(first);
  expect(fresh(first.nodes, moved.nodes).filter((id) => id.length > 5)).toEqual([one]);
  expect(moved.around).toBe(first.around); // so that arrows are not looked at at all
  expect(moved.edges).toBe(first.edges);

  rename(doc, other, "Renamed");
  const renamed = made(moved);
  expect(fresh(moved.nodes, renamed.nodes).filter((id) => id.length > 5)).toEqual([other]);
  const named = fresh(moved.edges, renamed.edges);
  expect(named.length).toBe(1);
  expect(named[0]).toContain(other);
});
