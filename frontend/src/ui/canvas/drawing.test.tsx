// @vitest-environment jsdom
import { ReactFlowProvider } from "@xyflow/react";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { addAction, moveActions, rename } from "../../graph/edit";
import type { Graph } from "../../graph/model";
import { followGraph } from "../../graph/read";
import { ActionCard } from "./action-card";
import { placesOf } from "./arrange";
import { type CanvasNode, type CardNode, keep, nodesOf } from "./elements";

const ACTIONS = 1000;

/** The actions whose cards React rendered: each card asks once for the comments about its action. */
const { rendered } = vi.hoisted(() => ({ rendered: [] as string[] }));
vi.mock("./spotlight", async (original) => {
  const real = await original<typeof import("./spotlight")>();
  const useTalk = (key: string) => {
    rendered.push(key);
    return real.useTalk(key);
  };
  return { ...real, useTalk };
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
  const options = { places: placesOf(graph), selected: new Set<string>(), others };
  const none = { progress: new Map(), marks: new Map(), measured: new Map() };
  nodes = keep(nodes, nodesOf(graph, { ...options, ...none }));
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

test("of a thousand actions only those that somebody changed are rendered again", {
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
