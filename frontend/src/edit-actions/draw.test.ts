import { expect, test } from "vitest";
import * as Y from "yjs";
import { addAction, connect, setExit } from "../graph/edit";
import { graphNow } from "../graph/edit/document-writes";
import { notesOf, writeNote } from "../graph/edit/notes";
import { ENTRY } from "../graph/model";
import { connectTo, removeSelection } from "./draw";
import { addActionAt, type EditorContext, type Overlay } from "./editor-context";

function editor(doc: Y.Doc, selection: readonly string[]) {
  const opened: (Overlay | null)[] = [];
  const context = {
    doc,
    graph: graphNow(doc),
    selection: new Set(selection),
    positions: () => new Map(),
    select: () => {},
    openOverlay: (overlay: Overlay | null) => opened.push(overlay),
  } as unknown as EditorContext;
  return { context, opened };
}

test("the first action is what the graph starts with, the second is not", () => {
  const doc = new Y.Doc();
  const first = addActionAt(editor(doc, []).context, { name: "Look" }, [0, 0]);
  addActionAt(editor(doc, []).context, { name: "Grip" }, [0, 200]);
  expect(graphNow(doc).relations.map(({ parent, child }) => [parent, child])).toEqual([
    [ENTRY, first],
  ]);
});

test("the next arrow goes on from the end of the one that was drawn last", () => {
  const doc = new Y.Doc();
  const [look, grip] = [addAction(doc, { name: "Look" }), addAction(doc, { name: "Grip" })];
  const arrow = connect(doc, look, grip) ?? "";
  const from = (selected: string) => {
    const { context, opened } = editor(doc, [selected]);
    connectTo.run(context);
    return opened[0];
  };
  expect(from(arrow)).toEqual({ kind: "arrow", from: grip, to: null });
  expect(from(look)).toEqual({ kind: "arrow", from: look, to: null });
  setExit(doc, grip);
  expect(from(`${grip}>exit`)).toEqual({ kind: "arrow", from: grip, to: null });
});

test("a frame that is deleted leaves what lies in it", () => {
  const doc = new Y.Doc();
  addAction(doc, { name: "Look", position: [50, 50] });
  const frame = { kind: "frame", at: [0, 0], size: [400, 300], text: "", color: "blue" } as const;
  const [chosen, other] = [writeNote(doc, frame), writeNote(doc, frame)];
  removeSelection.run(editor(doc, [chosen]).context);
  expect(notesOf(graphNow(doc)).map(({ key }) => key)).toEqual([other]);
  expect(graphNow(doc).actions.map(({ name }) => name)).toEqual(["Look"]);
});
