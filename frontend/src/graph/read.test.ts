import { readdirSync, readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsFrom, mapsOf, ROOTS, type Root } from "./document-keys";
import type { Graph } from "./model";
import { followGraph, readGraph } from "./read";

const folder = new URL("../../../tests/vectors/document/", import.meta.url);
const vectors = readdirSync(fileURLToPath(folder)).sort();

interface Vector {
  readonly about: string;
  readonly maps: Partial<Record<Root, Record<string, unknown>>>;
  readonly graph: Graph;
}

const A = "AAAAAAAAAAA1";
const B = "BBBBBBBBBBB2";

test.each(vectors)("the document reads as the vectors say: %s", (name) => {
  const vector = JSON.parse(readFileSync(new URL(name, folder), "utf8")) as Vector;
  expect(readGraph(mapsFrom(vector.maps)), vector.about).toEqual(vector.graph);
});

const owners = fc.constantFrom(A, B, "CCCCCCCCCCC3", "entry", "exit", "short", "");
const heads = fc.oneof(
  owners,
  fc
    .tuple(owners, fc.constantFrom(">", ""), owners, fc.constantFrom("", ";1", ";x"))
    .map((parts) => parts.join("")),
);
const fields = fc.constantFrom(
  ..."|type |instance_id |order |missing |twin |in |in/a |in/b |out/ |x/name |on_true".split(" "),
  ..."|on_false |po |co |required |only |remap |remap/a |x/parents/p |x/children/c |x |x/parents |x/a |".split(
    " ",
  ),
  "",
);
const keys = fc.oneof(
  { weight: 9, arbitrary: fc.tuple(heads, fields).map((parts) => parts.join("")) },
  { weight: 1, arbitrary: fc.string({ maxLength: 3 }) },
);
const values = fc.oneof(
  fc.constantFrom<unknown>("run", "ignore", "A", "B", "[]", '["b","a"]', "{", "1", true, false),
  fc.integer({ min: -1, max: 3 }),
  fc.anything({ maxDepth: 1, withDate: false, withMap: false, withSet: false }),
);
const writes = fc.array(
  fc.record({
    root: fc.constantFrom(...ROOTS),
    key: keys,
    value: fc.option(values, { nil: undefined }),
  }),
  { maxLength: 30 },
);

test("no content of a document makes reading fail, and following reads what reading at once does", () => {
  fc.assert(
    fc.property(fc.array(writes, { maxLength: 6 }), (transactions) => {
      const doc = new Y.Doc();
      const source = followGraph(doc);
      for (const transaction of transactions) {
        doc.transact(() => {
          for (const { root, key, value } of transaction) {
            if (value === undefined) doc.getMap(root).delete(key);
            else trySet(doc.getMap(root), key, value);
          }
        });
        expect(source.graph()).toEqual(readGraph(mapsOf(doc)));
      }
      source.close();
    }),
  );
});

/** Yjs itself refuses some values (symbols, functions). */
function trySet(map: Y.Map<unknown>, key: string, value: unknown): void {
  try {
    map.set(key, value);
  } catch {
    map.delete(key);
  }
}

function twoActions(): Y.Doc {
  const doc = new Y.Doc();
  doc.transact(() => {
    const actions = doc.getMap("actions");
    actions.set(A, "Wait");
    actions.set(B, "Scan");
    doc.getMap("relations").set(`${A}>${B}|on_true`, "run");
  });
  return doc;
}

test("parts that did not change stay the same objects", () => {
  const doc = twoActions();
  const source = followGraph(doc);
  const before = source.graph();
  doc.getMap("actions").set(`${B}|description`, "looks around");
  const after = source.graph();
  expect(after).not.toBe(before);
  expect(after.actions[0]).toBe(before.actions[0]);
  expect(after.actions[1]).not.toBe(before.actions[1]);
  expect(after.relations).toBe(before.relations);
});

test("writing what is there already changes nothing", () => {
  const doc = twoActions();
  const source = followGraph(doc);
  const before = source.graph();
  doc.getMap("actions").set(A, "Wait");
  doc.getMap("comments").set("t/m", "{}");
  doc.getMap("actions").set("no action|type", "x");
  expect(source.graph()).toBe(before);
});

test("a renumbered action and a redirected arrow keep their identity while others change", () => {
  const doc = twoActions();
  doc.transact(() => {
    doc.getMap("actions").set("CCCCCCCCCCC3", "Scan"); // renumbered to 1
    doc.getMap("actions").set("DDDDDDDDDDD4", "Wait");
    doc.getMap("actions").set("DDDDDDDDDDD4|missing", true); // taken up by A
    doc.getMap("relations").set(`${B}>DDDDDDDDDDD4|on_true`, "run");
  });
  const source = followGraph(doc);
  const before = source.graph();
  doc.getMap("meta").set("name", "renamed");
  const after = source.graph();
  expect(after.name).toBe("renamed");
  expect(after.actions).toBe(before.actions);
  expect(after.relations).toBe(before.relations);
  expect(after.relations.map((relation) => relation.child)).toEqual([B, A]);
});

test("a listener hears each transaction once, and nothing after it left", () => {
  const doc = twoActions();
  const source = followGraph(doc);
  let heard = 0;
  const leave = source.subscribe(() => {
    heard += 1;
  });
  doc.transact(() => {
    doc.getMap("actions").set(A, "Go");
    doc.getMap("meta").set("name", "g");
    doc.getMap("positions").set(A, [1, 2]);
  });
  expect(heard).toBe(1);
  leave();
  doc.getMap("actions").set(A, "Stay");
  expect(heard).toBe(1);
});
