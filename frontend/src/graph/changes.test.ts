import { expect, test } from "vitest";
import * as Y from "yjs";
import { changesOf, onlyChanges, type ValuesByRoot } from "./changes";
import { type Maps, mapsFrom, mapsOf, ROOTS, rootOf } from "./document-keys";
import {
  addAction,
  addParameter,
  connect,
  moveActions,
  rename,
  setField,
  setGraphName,
} from "./edit";
import { ENTRY } from "./model";
import { isEqual } from "./values";

/** Returns the changed keys between two documents, with the values after and before. */
function between(then: Maps, here: Maps): { difference: ValuesByRoot; before: ValuesByRoot } {
  const [difference, before] = [mapsFrom({}), mapsFrom({})] as unknown as Record<
    (typeof ROOTS)[number],
    Map<string, unknown>
  >[];
  for (const root of ROOTS) {
    for (const key of new Set([...then[root].keys(), ...here[root].keys()])) {
      if (isEqual(then[root].get(key), here[root].get(key))) continue;
      difference?.[root].set(key, here[root].get(key));
      before?.[root].set(key, then[root].get(key));
    }
  }
  return { difference: difference as ValuesByRoot, before: before as ValuesByRoot };
}

function worked(work: (doc: Y.Doc, look: string, gone: string) => void) {
  const doc = new Y.Doc();
  setGraphName(doc, "task");
  const look = addAction(doc, { name: "Look", position: [0, 0] });
  const gone = addAction(doc, { name: "Gone" });
  connect(doc, look, gone, "on_true");
  const then = mapsOf(doc);
  work(doc, look, gone);
  const here = mapsOf(doc);
  const given = { ...between(then, here), here };
  return { given, changes: changesOf(given, then), then, look, gone };
}

test("changes are told by what they are changes of, with the values before and after", () => {
  const { changes } = worked((doc, look) => {
    setGraphName(doc, "other");
    rename(doc, look, "Peek");
    setField(doc, look, "actor", "arm");
    addParameter(doc, look, "in", "speed", '{"pvf_type":"number","pvf_value":3}');
    moveActions(doc, new Map([[look, [10, 20.4]]]));
    const grip = addAction(doc, { name: "Grip" });
    connect(doc, look, grip, "on_false");
    connect(doc, ENTRY, look, "on_true");
  });
  const told = changes.map(({ kind, thing, title }) => [kind, thing, title].join(" "));
  expect(told).toEqual([
    "changed graph Graph",
    "changed action Peek",
    "added action Grip",
    "added arrow Peek → Grip",
    "added arrow Entry → Peek",
  ]);
  expect(changes[0]?.lines).toEqual([{ field: "Name", before: "task", after: "other" }]);
  expect(changes[1]?.lines).toEqual([
    { field: "Name", before: "Look", after: "Peek" },
    { field: "Robot", before: null, after: "arm" },
    { field: "Input speed", before: null, after: "3" },
    { field: "Place", before: "0, 0", after: "10, 20" },
  ]);
});

test("a deleted action is told by its name, and its arrows go with it", () => {
  const { changes } = worked((doc, _, gone) => {
    for (const key of [...rootOf(doc, "actions").keys()]) {
      if (key.startsWith(gone)) rootOf(doc, "actions").delete(key);
    }
    for (const key of [...rootOf(doc, "relations").keys()]) rootOf(doc, "relations").delete(key);
  });
  expect(changes.map(({ kind, title }) => `${kind} ${title}`)).toEqual([
    "removed Gone",
    "removed Look → Gone",
  ]);
});

test("the value that somebody else set meanwhile is shown", () => {
  const { given, then, look } = worked((doc, action) => rename(doc, action, "Peek"));
  const now = { ...then, actions: new Map([...then.actions, [look, "Stare"]]) };
  expect(changesOf(given, now)[0]?.lines).toEqual([
    { field: "Name", before: "Look", after: "Peek", now: "Stare" },
  ]);
  const without = new Map([...then.actions].filter(([key]) => key !== look));
  expect(changesOf(given, { ...then, actions: without })[0]?.lines[0]?.now).toBeNull();
});

test("a part of the changes is the keys of just those", () => {
  const { given, changes, look } = worked((doc, action) => {
    rename(doc, action, "Peek");
    setGraphName(doc, "other");
  });
  const part = onlyChanges(given.difference, changes.slice(1));
  expect([...part.actions]).toEqual([[look, "Peek"]]);
  expect(part.meta.size).toBe(0);
  const all = onlyChanges(given.difference, changes);
  expect(all).toEqual(given.difference);
});

test("long values are cut, and what is no parameter is shown as it stands", () => {
  const { changes } = worked((doc, look) => {
    setField(doc, look, "description", "x".repeat(500));
    rootOf(doc, "actions").set(`${look}|in/broken`, "{not json");
  });
  expect(changes[0]?.lines[0]?.after?.length).toBeLessThan(130);
  expect(changes[0]?.lines[1]?.after).toBe("{not json");
});
