import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf, noteKey } from "../document-keys";
import { readGraph } from "../read";
import { addAction, addNote } from ".";
import { changeNote, notesOf, placeNotes, readNote, withContents, writeNote } from "./notes";

const graphOf = (doc: Y.Doc) => readGraph(mapsOf(doc));

test("a note is what it was written as; members that others added stay when it changes", () => {
  const doc = new Y.Doc();
  const key = writeNote(doc, { kind: "note", at: [1, 2], size: [90, 40], text: "a", color: "red" });
  expect(notesOf(graphOf(doc))).toEqual([
    { key, kind: "note", at: [1, 2], size: [90, 40], text: "a", color: "red" },
  ]);
  const theirs = noteKey(addNote(doc, '{"kind":"note","at":[0,0],"text":"b","link":"x"}'));
  expect(changeNote(doc, theirs, { text: "c" })).toBe(true);
  const text = graphOf(doc).notes.find(([id]) => noteKey(id) === theirs)?.[1] ?? "";
  expect(JSON.parse(text)).toMatchObject({ link: "x", text: "c", at: [0, 0] });
});

test("moving a note that a page shows as it was keeps what others wrote into it since", () => {
  const doc = new Y.Doc();
  const key = writeNote(doc, { kind: "note", at: [1, 2], size: [90, 40], text: "a", color: "red" });
  const shown = graphOf(doc);
  changeNote(doc, key, { text: "theirs" });
  placeNotes(doc, shown, new Map([[key, [5, 6]]]));
  expect(notesOf(graphOf(doc))).toMatchObject([{ at: [5, 6], text: "theirs" }]);
});

test("any text that is no note is read as none", () => {
  fc.assert(
    fc.property(fc.oneof(fc.string(), fc.json()), (text) => {
      const note = readNote("g/1", text);
      expect(note === null || ["note", "frame"].includes(note.kind)).toBe(true);
    }),
  );
  expect(readNote("g/1", '{"kind":"note","at":[1e999,0]}')).toBeNull();
  expect(readNote("g/1", '{"kind":"frame","at":[0,0],"size":[-5,"x"]}')?.size).toEqual([320, 220]);
});

test("a frame takes along what lies in it, and nothing else", () => {
  const doc = new Y.Doc();
  const inside = addAction(doc, { name: "In", position: [50, 50] });
  const outside = addAction(doc, { name: "Out", position: [900, 50] });
  const frame = writeNote(doc, {
    kind: "frame",
    at: [0, 0],
    size: [400, 300],
    text: "",
    color: "blue",
  });
  const note = writeNote(doc, {
    kind: "note",
    at: [20, 200],
    size: [80, 40],
    text: "",
    color: "grey",
  });
  const graph = graphOf(doc);
  const places = new Map([
    [inside, [50, 50] as const],
    [outside, [900, 50] as const],
    ...notesOf(graph).map(({ key, at }) => [key, at] as const),
  ]);
  const sizes = new Map([[note, { width: 80, height: 40 }]]);
  const moved = withContents(graph, new Map([[frame, [100, 10] as const]]), places, sizes);
  expect(Object.fromEntries(moved)).toEqual({
    [frame]: [100, 10],
    [inside]: [150, 60],
    [note]: [120, 210],
  });
  placeNotes(doc, graph, moved);
  expect(
    notesOf(graphOf(doc))
      .map(({ at }) => at)
      .sort(),
  ).toEqual([
    [100, 10],
    [120, 210],
  ]);
});
