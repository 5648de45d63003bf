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
import { asLogged, ChangedTwiceStore } from "./changed-twice";
import type { ChangedTwice, UnsavedEdit } from "./indexed-db";
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

/** Lets this page and others work while it is offline, and brings it back. */
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
  test("the server gets the value of this page, from which the history tells it", () => {
    open(wins);
    const a = addAction(room.doc, { name: "A" });
    apart(
      (doc) => setField(doc, a, "description", "mine"),
      (doc) => setField(doc, a, "description", "theirs"),
    );
    const sent = server.last.received.map((data) => new TextDecoder("latin1").decode(data));
    expect(sent.some((text) => text.includes("mine"))).toBe(true);
  });

  test("a field that two people changed is told with two values, and one of them is chosen", () => {
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

  test("a change between the return and the acknowledgement is told, too", () => {
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

test("an edit that waits for seconds on a dead socket is compared; edits of the same moment are not", () => {
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

test("a value of others that came as collected is the newest one of others that the log has since", () => {
  open(true);
  server.seq = 5;
  server.ack(server.last);
  server.last.end(1006);
  let update: Uint8Array = new Uint8Array();
  room.doc.once("update", (made: Uint8Array) => {
    update = made;
  });
  room.doc.getMap("meta").set("description", "mine");
  server.broadcast((doc) => doc.getMap("meta").set("description", "theirs"));
  Y.applyUpdate(server.doc, update); // over a socket whose end nobody had noticed
  vi.advanceTimersByTime(300);
  server.accept();
  const [twice] = room.changedTwice.now() as [ChangedTwice];
  expect(twice).toMatchObject({ mine: "mine", since: 5, writes: { theirs: null } });
  const step = (seq: number, author: string, after: unknown, key = "description") => ({
    ...{ seq, author, root: "meta" as const, key, after },
  });
  const steps = [step(5, "mari", "old"), step(6, "mari", "theirs"), step(7, "ada", "mine")];
  const known = asLogged(twice, [...steps, step(8, "mari", "other", "name")], "ada");
  expect(known?.theirs).toBe("theirs");
  expect(asLogged(twice, [step(5, "mari", "old"), step(7, "ada", "mine")], "ada")).toBeNull();
  const lost = { ...step(8, "mari", "mine"), overwritten: "theirs" };
  expect(asLogged(twice, [...steps.slice(2), lost], "ada")?.theirs).toBe("theirs");
  room.changedTwice.choose(known as ChangedTwice, "theirs");
  expect(server.doc.getMap("meta").get("description")).toBe("theirs");
});

// -- who stayed ---------------------------------------------------------------------------------

/** Takes a colleague offline who works by `work`; the returned function brings their edits to the server. */
function away(work: (doc: Y.Doc) => void): () => void {
  const doc = new Y.Doc();
  Y.applyUpdate(doc, Y.encodeStateAsUpdate(server.doc));
  doc.clientID = 3_000; // above this page's: their value stands
  const at = Y.encodeStateVector(doc);
  work(doc);
  const update = Y.encodeStateAsUpdate(doc, at);
  return () => server.broadcast((all) => Y.applyUpdate(all, update));
}

const later = () => vi.advanceTimersByTime(3_000);

describe("a person who stayed on the page", () => {
  let a: string;

  beforeEach(() => {
    open(true);
    a = addAction(room.doc, { name: "A" });
    setField(room.doc, a, "actor", "before");
    later();
  });

  test("is told when an edit that had not seen their value replaces it, and can take it back", () => {
    const comeBack = away((doc) => setField(doc, a, "actor", "theirs"));
    setField(room.doc, a, "actor", "mine");
    later();
    comeBack();
    expect(actionIn(room.doc, a)?.actor).toBe("theirs");
    expect(told(room.changedTwice.now())).toEqual([["actor", "mine", "theirs"]]);
    const [twice] = room.changedTwice.now() as [ChangedTwice];
    expect([twice.cause, room.changedTwice.stands(twice)]).toEqual(["unseen", "theirs"]);
    room.changedTwice.choose(twice, "mine");
    expect(actionIn(server.doc, a)?.actor).toBe("mine");
  });

  test("is told also where the other erased or set it several times", () => {
    const comeBack = away((doc) => {
      setField(doc, a, "actor", "first");
      setField(doc, a, "actor", "second");
      setField(doc, a, "actor", "");
    });
    setField(room.doc, a, "actor", "mine");
    later();
    comeBack();
    expect(told(room.changedTwice.now())).toEqual([["actor", "mine", ""]]);
  });

  test("is told when an action with their work is deleted by somebody who had not seen it", () => {
    const b = addAction(room.doc, { name: "B" });
    connect(room.doc, a, b);
    later();
    const comeBack = away((doc) => removeActions(doc, [a]));
    setField(room.doc, a, "description", "mine");
    later();
    const before = graphIn(room.doc);
    comeBack();
    expect(told(room.changedTwice.now())).toEqual([["", "A", undefined]]);
    const [twice] = room.changedTwice.now() as [ChangedTwice];
    room.changedTwice.choose(twice, "mine");
    expect(graphIn(server.doc)).toEqual(before);
  });

  test("hears nothing of edits that had seen their value, that come at once, or that lose", () => {
    setField(room.doc, a, "actor", "mine");
    away((doc) => setField(doc, a, "actor", "later"))();
    setField(room.doc, a, "actor", "mine again");
    later();
    const comeBack = away((doc) => removeActions(doc, [a]));
    later();
    comeBack();
    expect(room.changedTwice.now()).toEqual([]);

    const b = addAction(room.doc, { name: "B" });
    later();
    const atOnce = away((doc) => setField(doc, b, "actor", "theirs"));
    setField(room.doc, b, "actor", "mine");
    vi.advanceTimersByTime(500);
    atOnce();
    expect(actionIn(room.doc, b)?.actor).toBe("theirs");
    expect(room.changedTwice.now()).toEqual([]);
  });

  test("hears nothing where somebody else had replaced their value before", () => {
    const comeBack = away((doc) => setField(doc, a, "actor", "offline"));
    setField(room.doc, a, "actor", "mine");
    later();
    away((doc) => setField(doc, a, "actor", "a third"))();
    later();
    comeBack();
    expect(room.changedTwice.now()).toEqual([]);
  });
});

test("the person who stayed is told each stored value that was replaced unseen, and no other", () => {
  const steps = fc.array(
    fc.oneof(
      fc.tuple(fc.constantFrom("ada", "bo"), fc.nat(2), fc.constantFrom("a", "b", "c", null)),
      fc.constantFrom("to bo", "back"),
    ),
    { maxLength: 14, size: "max" },
  );
  fc.assert(
    fc.property(steps, fc.boolean(), (script, wins) => {
      const [ada, bo] = [new Y.Doc(), new Y.Doc()];
      [ada.clientID, bo.clientID] = wins ? [1_000, 2_000] : [2_000, 1_000];
      const store = new ChangedTwiceStore(ada);
      const edits: UnsavedEdit[] = [];
      ada.on("update", (update: Uint8Array, origin: unknown) => {
        if (origin !== "bo") edits.push({ id: `${edits.length}`, update, at: 0 });
      });
      /** By key: how often Ada set it, how often by what Bo has received, and that number at each set of Bo's. */
      const places = PLACES.slice(0, 3).map(() => ({ set: 0, received: 0, knew: [] as number[] }));
      for (const step of script) {
        if (step === "to bo") {
          Y.applyUpdate(bo, Y.encodeStateAsUpdate(ada, Y.encodeStateVector(bo)));
          for (const place of places) place.received = place.set;
        } else if (step === "back") {
          store.durable(edits.splice(0));
          later();
          store.dismiss();
          const old = valuesIn(ada);
          const shownBy = PLACES.map(([root, key]) => rootOf(ada, root)._map.get(key)?.id.client);
          store.take([], 0, () =>
            Y.applyUpdate(ada, Y.encodeStateAsUpdate(bo, Y.encodeStateVector(ada)), "bo"),
          );
          const now = valuesIn(ada);
          places.forEach((place, n) => {
            const [root, key] = PLACES[n] as readonly [Root, string];
            const id = `${root} ${key}`;
            const isReplaced =
              old.has(id) && shownBy[n] === ada.clientID && old.get(id) !== now.get(id);
            const twice = store.now().find((each) => each.id === id);
            const unseen = place.knew.filter((count) => count < place.set);
            if (twice !== undefined) {
              expect(isReplaced && unseen.length > 0).toBe(true);
              expect([twice.mine, twice.theirs]).toEqual([old.get(id), now.get(id)]);
            } else if (unseen.length > 0 && unseen.length === place.knew.length) {
              const isErasedOnly = rootOf(ada, root)._map.get(key)?.id.client === ada.clientID;
              expect(isReplaced && !isErasedOnly).toBe(false);
            }
            place.knew = [];
          });
        } else {
          const [who, n, value] = step;
          const place = places[n] as (typeof places)[number];
          play(who === "ada" ? ada : bo, [[n, value]]);
          if (who === "ada") place.set += 1;
          else if (value !== null) place.knew.push(place.received);
        }
      }
    }),
    { numRuns: 500 },
  );
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

test("each field that two people set at the same time is told, and no other", () => {
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
      store.take(waiting, 0, () =>
        Y.applyUpdate(mine, Y.encodeStateAsUpdate(theirs, at), "remote"),
      );
      const found = new Map(store.now().map((each) => [each.id, each]));
      const now = valuesIn(mine);
      for (const [root, key] of PLACES) {
        const id = `${root} ${key}`;
        const [was, me, them] = [old, own, other].map((values) => values.get(id));
        const twice = found.get(id);
        if (twice === undefined) {
          // No value is lost without a word.
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
