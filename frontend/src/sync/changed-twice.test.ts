import fc from "fast-check";
import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { mapsOf, ROOTS, type Root, rootOf } from "../graph/document-keys";
import {
  addAction,
  addParameter,
  asOneEdit,
  connect,
  removeActions,
  setField,
  undoOf,
} from "../graph/edit";
import { actionIn, arrows, graphIn } from "../testing/edited-graph";
import { FakeServer } from "../testing/fake-server";
import { type ChangedTwice, ChangedTwiceStore } from "./changed-twice";
import type { UnsavedEdit } from "./indexed-db";
import { connectRoom, type Room } from "./room-connection";

let server: FakeServer;
let room: Room;

beforeEach(() => {
  vi.useFakeTimers();
  server = new FakeServer();
});

afterEach(() => {
  room.close();
  vi.useRealTimers();
});

/** Opens the room; `wins`: whether the value of this page stands where two were set at once. */
function open(wins: boolean): void {
  const doc = new Y.Doc();
  [doc.clientID, server.doc.clientID] = wins ? [2_000, 1_000] : [1_000, 2_000];
  room = connectRoom({ url: "ws://host/room", doc, open: server.open, random: () => 1 });
  server.accept();
}

/** Both work while this page is away, and it comes back. */
function apart(here: (doc: Y.Doc) => void, there: (doc: Y.Doc) => void): readonly ChangedTwice[] {
  server.last.end(1006);
  here(room.doc);
  server.broadcast(there);
  vi.advanceTimersByTime(300);
  server.accept();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(graphIn(room.doc)).toEqual(graphIn(server.doc));
  return room.changedTwice.now();
}

const told = (all: readonly ChangedTwice[]) =>
  all.map(({ key, mine, theirs }) => [key.split("|")[1] ?? "", mine, theirs]);

describe.each([true, false])("where the value of this page stands: %s", (wins) => {
  test("both values of a field that both have changed are told, and one of them is chosen", () => {
    open(wins);
    const a = addAction(room.doc, { name: "A" });
    const undo = undoOf(room.doc);
    const found = apart(
      (doc) => {
        setField(doc, a, "description", "mine");
        setField(doc, a, "actor", "only mine");
      },
      (doc) => {
        setField(doc, a, "description", "theirs");
        setField(doc, a, "type", "only theirs");
      },
    );
    expect(told(found)).toEqual([["description", "mine", "theirs"]]);
    const [twice] = found as [ChangedTwice];
    const first = wins ? "mine" : "theirs";
    const second = wins ? "theirs" : "mine";
    const stands = () => room.changedTwice.stands(twice);
    expect([stands(), actionIn(server.doc, a)?.description]).toEqual([first, first]);
    room.changedTwice.choose(twice, second);
    expect([stands(), actionIn(server.doc, a)?.description]).toEqual([second, second]);
    undo.undo();
    expect([stands(), actionIn(server.doc, a)?.description]).toEqual([first, first]);
    room.changedTwice.dismiss();
    expect(room.changedTwice.now()).toEqual([]);
  });

  test("an action that somebody deleted while this person worked on it can be brought back whole", () => {
    open(wins);
    const [a, b] = [addAction(room.doc, { name: "A" }), addAction(room.doc, { name: "B" })];
    addParameter(room.doc, a, "in", "x", "1");
    connect(room.doc, a, b);
    const before = graphIn(room.doc);
    const found = apart(
      (doc) => setField(doc, a, "description", "mine"),
      (doc) => removeActions(doc, [a]),
    );
    expect(told(found)).toEqual([["", "A", undefined]]);
    const [twice] = found as [ChangedTwice];
    expect(room.changedTwice.stands(twice)).toBe("theirs");
    room.changedTwice.choose(twice, "mine");
    const changed = before.actions.map((each) =>
      each.key === a ? { ...each, description: "mine" } : each,
    );
    expect(graphIn(server.doc).actions).toEqual(changed);
    expect(arrows(server.doc)).toEqual(["A>B"]);
    room.changedTwice.choose(twice, "theirs");
    expect(actionIn(server.doc, a)).toBeUndefined();
  });

  test("an action that this person deleted while somebody worked on it can be brought back with their work", () => {
    open(wins);
    const [a, b] = [addAction(room.doc, { name: "A" }), addAction(room.doc, { name: "B" })];
    addParameter(room.doc, a, "in", "x", "1");
    connect(room.doc, a, b);
    const found = apart(
      (doc) => removeActions(doc, [a]),
      (doc) => addParameter(doc, a, "in", "y", "2"),
    );
    expect(told(found)).toEqual([["", undefined, "A"]]);
    const [twice] = found as [ChangedTwice];
    expect(room.changedTwice.stands(twice)).toBe("mine");
    room.changedTwice.choose(twice, "theirs");
    expect(actionIn(server.doc, a)?.inputs.map(({ path }) => path)).toEqual(["x", "y"]);
    expect(arrows(server.doc)).toEqual(["A>B"]);
  });

  test("what comes between the return and the acknowledgement is told, too", () => {
    open(wins);
    const a = addAction(room.doc, { name: "A" });
    server.last.end(1006);
    setField(room.doc, a, "actor", "mine");
    vi.advanceTimersByTime(300);
    server.stalled = true;
    server.accept();
    server.broadcast((doc) => setField(doc, a, "actor", "theirs"));
    expect(told(room.changedTwice.now())).toEqual([["actor", "mine", "theirs"]]);
    server.stalled = false;
    server.commit();
    server.broadcast((doc) => setField(doc, a, "actor", "later"));
    expect(told(room.changedTwice.now())).toEqual([["actor", "mine", "theirs"]]);
  });
});

test("what waits for seconds on a socket that does not notice is told; what two do at once is not", () => {
  open(true);
  const a = addAction(room.doc, { name: "A" });
  server.stalled = true;
  setField(room.doc, a, "actor", "mine");
  server.broadcast((doc) => setField(doc, a, "actor", "theirs"));
  expect(room.changedTwice.now()).toEqual([]);
  setField(room.doc, a, "description", "mine");
  vi.advanceTimersByTime(3_000);
  server.broadcast((doc) => setField(doc, a, "description", "theirs"));
  expect(told(room.changedTwice.now())).toEqual([["description", "mine", "theirs"]]);
});

// -- whatever both do -------------------------------------------------------------------------

const PLACES: readonly (readonly [Root, string])[] = [
  ["meta", "description"],
  ["actions", "aaaaaaaaaaaa|actor"],
  ["relations", "aaaaaaaaaaaa>bbbbbbbbbbbb|on_true"],
  ["positions", "g/note"],
  ["comments", "thread/message"],
];
const work = fc.array(fc.tuple(fc.nat(PLACES.length - 1), fc.constantFrom("a", "b", "c", null)), {
  maxLength: 8,
  size: "max",
});

function play(doc: Y.Doc, script: readonly (readonly [number, string | null])[]): void {
  for (const [n, value] of script) {
    const [root, key] = PLACES[n] as readonly [Root, string];
    asOneEdit(doc, () => {
      if (value === null) rootOf(doc, root).delete(key);
      else rootOf(doc, root).set(key, value);
    });
  }
}

const valuesIn = (doc: Y.Doc) => {
  const maps = mapsOf(doc);
  return new Map(ROOTS.flatMap((root) => [...maps[root]].map(([k, v]) => [`${root} ${k}`, v])));
};

test("whatever both set at the same time, each field with two values is told, and no other", () => {
  fc.assert(
    fc.property(work, work, work, fc.boolean(), (before, here, there, wins) => {
      const mine = new Y.Doc();
      play(mine, before);
      const theirs = new Y.Doc();
      Y.applyUpdate(theirs, Y.encodeStateAsUpdate(mine));
      [mine.clientID, theirs.clientID] = wins ? [2_000, 1_000] : [1_000, 2_000];
      const at = Y.encodeStateVector(theirs);
      const old = valuesIn(mine);
      const waiting: UnsavedEdit[] = [];
      for (const step of here) {
        const [root, key] = PLACES[step[0]] as readonly [Root, string];
        const had = rootOf(mine, root).get(key);
        mine.once("update", (update: Uint8Array) => {
          waiting.push({ id: `${waiting.length}`, update, at: 0, before: [[root, key, had]] });
        });
        play(mine, [step]);
      }
      play(theirs, there);
      const [own, other] = [valuesIn(mine), valuesIn(theirs)];
      const store = new ChangedTwiceStore(mine);
      store.back(waiting);
      store.take(waiting, () => Y.applyUpdate(mine, Y.encodeStateAsUpdate(theirs, at), "remote"));
      const found = new Map(store.now().map((each) => [each.id, each]));
      const now = valuesIn(mine);
      for (const [root, key] of PLACES) {
        const id = `${root} ${key}`;
        const [was, me, them] = [old, own, other].map((values) => values.get(id));
        const twice = found.get(id);
        if (twice === undefined) {
          // Nobody's value is lost without a word.
          expect([me, them === was ? me : them, was]).toContain(now.get(id));
          if (me !== was && them !== was && them !== undefined) expect(me).toEqual(them);
        } else {
          expect([twice.mine, twice.theirs]).toEqual([me, them]);
          expect(me).not.toEqual(them);
          expect(["mine", "theirs"]).toContain(store.stands(twice));
        }
      }
    }),
    { numRuns: 300 },
  );
});
