// @vitest-environment jsdom
import { act, type MouseEvent } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import type { EditorContext } from "../../edit-actions/editor-context";
import { addAction } from "../../graph/edit";
import { graphNow } from "../../graph/edit/document-writes";
import { useConnecting } from "./use-connecting";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

let root: Root;
let context: EditorContext;
let connecting: ReturnType<typeof useConnecting>;
const openAddAt = vi.fn();

function Page() {
  connecting = useConnecting(context, openAddAt);
  return null;
}

beforeEach(() => {
  openAddAt.mockReset();
  context = { doc: new Y.Doc(), select: () => {}, mayEdit: true } as unknown as EditorContext;
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() => root.render(<Page />));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
});

/** A card with one mark, which lies under every point from now on. */
function underPointer(key: string): Element {
  const card = document.body.appendChild(document.createElement("div"));
  card.className = "react-flow__node";
  card.dataset.id = key;
  const mark = card.appendChild(document.createElement("i"));
  mark.className = "react-flow__handle source";
  mark.dataset.nodeid = key;
  mark.dataset.handleid = "on_error";
  document.elementsFromPoint = () => [card];
  return mark;
}

const click = (target: Element) =>
  act(() => void connecting.onClick({ target, clientX: 0, clientY: 0 } as unknown as MouseEvent));

test("drawing an arrow by dragging cancels an outcome that was tapped before", () => {
  const [a, b, c] = ["A", "B", "C"].map((name) => addAction(context.doc, { name }));
  if (!a || !b || !c) throw new Error("no actions");
  click(underPointer(a));
  expect(connecting.pending).toEqual({ key: a, outcome: "on_error" });
  act(() => connecting.draw(b, c, "on_true"));
  expect(connecting.pending).toBeNull();
  const card = underPointer(c).parentElement;
  if (card) click(card);
  expect(graphNow(context.doc).relations.map(({ parent, child }) => [parent, child])).toEqual([
    [b, c],
  ]);
});
