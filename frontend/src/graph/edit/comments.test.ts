import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { rootOf } from "../document-keys";
import {
  beginThread,
  deleteMessage,
  openThreadCounts,
  readThreads,
  reply,
  resolve,
} from "./comments";
import { undoOf } from "./document-writes";

const ada = { id: "a", name: "Ada" };
const mari = { id: "m", name: "Mari" };
const threads = (doc: Y.Doc) => readThreads(rootOf(doc, "comments").entries());
const about = "ActionAction";

test("a thread has its messages in order, is resolved, and opened again", () => {
  const doc = new Y.Doc();
  const id = beginThread(doc, about, { author: ada, at: 1, text: "Too fast?" });
  reply(doc, id, { author: mari, at: 2, text: "Slower now." });
  expect(threads(doc)).toMatchObject([
    {
      id,
      about,
      resolved: false,
      messages: [{ author: ada, text: "Too fast?" }, { author: mari }],
    },
  ]);
  expect(openThreadCounts(threads(doc))).toEqual(new Map([[about, 1]]));
  resolve(doc, id, true, { author: ada, at: 3 });
  expect(threads(doc)[0]?.resolved).toBe(true);
  expect(openThreadCounts(threads(doc)).size).toBe(0);
  resolve(doc, id, false, { author: mari, at: 4 });
  expect(threads(doc)[0]?.resolved).toBe(false);
});

test("a thread about a parameter keeps that when its first message is taken back", () => {
  const doc = new Y.Doc();
  const id = beginThread(doc, about, { author: ada, at: 1, text: "In m/s?" }, "in/speed");
  reply(doc, id, { author: mari, at: 2, text: "Yes." });
  const first = threads(doc)[0]?.messages[0]?.id ?? "";
  deleteMessage(doc, id, first);
  expect(threads(doc)).toMatchObject([{ about, parameter: "in/speed", messages: [{ at: 2 }] }]);
  expect(openThreadCounts(threads(doc))).toEqual(new Map([[about, 1]]));
});

test("two people who answer at once are both heard, and everybody sees the same", () => {
  const doc = new Y.Doc();
  const id = beginThread(doc, about, { author: ada, at: 1, text: "Why?" });
  const other = new Y.Doc();
  Y.applyUpdate(other, Y.encodeStateAsUpdate(doc));
  reply(doc, id, { author: ada, at: 2, text: "one" });
  reply(other, id, { author: mari, at: 2, text: "two" });
  Y.applyUpdate(other, Y.encodeStateAsUpdate(doc));
  Y.applyUpdate(doc, Y.encodeStateAsUpdate(other));
  expect(threads(doc)[0]?.messages.length).toBe(3);
  expect(threads(other)).toEqual(threads(doc));
});

test("a message can be taken back, the first one too while others have answered, and undone", () => {
  const doc = new Y.Doc();
  const undo = undoOf(doc);
  const id = beginThread(doc, about, { author: ada, at: 1, text: "first" });
  reply(doc, id, { author: mari, at: 2, text: "second" });
  const first = threads(doc)[0]?.messages[0]?.id ?? "";
  deleteMessage(doc, id, first);
  expect(threads(doc)[0]).toMatchObject({ about, messages: [{ text: "second" }] });
  undo.undo();
  expect(threads(doc)[0]?.messages.map(({ text }) => text)).toEqual(["first", "second"]);
});

test("reading comments does not fail and invents no author, whatever is stored there", () => {
  const values = fc.oneof(fc.string(), fc.json(), fc.jsonValue());
  fc.assert(
    fc.property(fc.array(fc.tuple(fc.string(), values)), (entries) => {
      for (const thread of readThreads(entries)) {
        expect(thread.messages.length).toBeGreaterThan(0);
        expect(typeof thread.messages[0]?.author.name).toBe("string");
      }
    }),
  );
});
