// @vitest-environment jsdom
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { foldingOf } from "../../canvas/folding/folding";
import { positionsOf } from "../../canvas/geometry/arrange";
import { notePlaces } from "../../canvas/notes/note-nodes";
import type { EditorContext } from "../../edit-actions/editor-context";
import { addAction, moveActions } from "../../graph/edit";
import { graphNow } from "../../graph/edit/document-writes";
import { writeNote } from "../../graph/edit/notes";
import type { Key } from "../../graph/model";
import { useUnfolding } from "./use-viewport";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

let root: Root;
let doc: Y.Doc;
let frame: string;
let unfoldRound: (keys: readonly Key[]) => void;
const fold = vi.fn();

function Page({ selection }: { selection: readonly string[] }) {
  const graph = graphNow(doc);
  const places = new Map([...positionsOf(graph), ...notePlaces(graph)]);
  const folding = foldingOf(graph, folded, places, NONE);
  const context = { graph, folded, fold, selection: new Set(selection) };
  const canvas = { folding, places, sizes: NONE };
  unfoldRound = useUnfolding(context as unknown as EditorContext, canvas).unfoldRound;
  return null;
}
let folded: ReadonlySet<string>;
const NONE = new Map();
const show = (...selection: string[]) => act(() => root.render(<Page selection={selection} />));

beforeEach(() => {
  fold.mockReset();
  doc = new Y.Doc();
  const at = { at: [0, 0], size: [500, 400], text: "", color: "blue" } as const;
  frame = writeNote(doc, { kind: "frame", ...at });
  folded = new Set([frame]);
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
});

test("showing an action in a folded frame unfolds it; showing another one does not", () => {
  const inside = addAction(doc, { name: "Look", position: [50, 50] });
  const outside = addAction(doc, { name: "Grip", position: [900, 50] });
  show();
  unfoldRound([outside, frame]);
  expect(fold).not.toHaveBeenCalled();
  unfoldRound([inside]);
  expect(fold).toHaveBeenCalledWith([frame], false);
});

test("a selected action that is moved into a folded frame unfolds it", () => {
  const moved = addAction(doc, { name: "Look", position: [900, 50] });
  show(moved);
  moveActions(doc, new Map([[moved, [50, 50] as const]]));
  show(moved);
  expect(fold).toHaveBeenCalledWith([frame], false);
});

test("a frame that is folded around the selection stays folded", () => {
  const inside = addAction(doc, { name: "Look", position: [50, 50] });
  folded = new Set();
  show(inside);
  folded = new Set([frame]);
  show(inside);
  expect(fold).not.toHaveBeenCalled();
});
