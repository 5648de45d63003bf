import fc from "fast-check";
import { describe, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { examples } from "../../testing/doses";
import { actionIn, arrows, copyOf, docWith, graphIn } from "../../testing/edited-graph";
import { mapsOf, ROOTS, type Root, rootOf } from "../document-keys";
import { fullName, type Key } from "../model";
import {
  addAction,
  addNote,
  addParameter,
  asOneEdit,
  connect,
  removeActions,
  rename,
  setField,
  setNote,
  setParameter,
  undoOf,
} from ".";
import { beginThread, readThreads } from "./comments";
import type { UndoStep } from "./undo-history";
import { setWaypoints } from "./waypoints";

/** Two copies of a document that are apart until `meet`: each update is brought over as it was sent. */
function apart(first: Y.Doc) {
  const [ann, ben] = [first, copyOf(first)] as const;
  // The higher client id wins.
  [ann.clientID, ben.clientID] = [2_000, 1_000];
  const waiting = new Map<Y.Doc, Uint8Array[]>([
    [ann, []],
    [ben, []],
  ]);
  for (const [doc, sent] of waiting) {
    doc.on("update", (update: Uint8Array, origin: unknown) => {
      if (origin !== "remote") sent.push(update);
    });
  }
  const meet = () => {
    const [fromAnn, fromBen] = [ann, ben].map((doc) => waiting.get(doc)?.splice(0) ?? []);
    for (const update of fromAnn ?? []) Y.applyUpdate(ben, update, "remote");
    for (const update of fromBen ?? []) Y.applyUpdate(ann, update, "remote");
    expect(graphIn(ann)).toEqual(graphIn(ben));
  };
  return { ann, ben, meet, undo: undoOf(ann), bensUndo: undoOf(ben) };
}

// -- two people set the same at the same time -------------------------------------------------

const names = (doc: Y.Doc) => graphIn(doc).actions.map(fullName);

describe("whose value won takes it back, and the value of the other is there", () => {
  test("of a parameter", () => {
    const [doc, a] = docWith("A") as [Y.Doc, Key];
    addParameter(doc, a, "in", "x", "0");
    const { ann, ben, meet, undo } = apart(doc);
    setParameter(ann, a, "in", "x", () => "1");
    setParameter(ben, a, "in", "x", () => "2");
    meet();
    expect(actionIn(ben, a)?.inputs).toEqual([{ path: "x", text: "1" }]);
    undo.undo();
    meet();
    expect(actionIn(ben, a)?.inputs).toEqual([{ path: "x", text: "2" }]);
    undo.redo();
    meet();
    expect(actionIn(ben, a)?.inputs).toEqual([{ path: "x", text: "1" }]);
  });

  test("of the name of an action, which keeps its arrows", () => {
    const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
    connect(doc, a, b);
    const { ann, ben, meet, undo } = apart(doc);
    rename(ann, a, "Mine");
    rename(ben, a, "Theirs");
    meet();
    undo.undo();
    meet();
    expect(names(ben)).toEqual(["Theirs_0", "B_0"]);
    expect(arrows(ben)).toEqual(["Theirs>B"]);
  });

  test("of an arrow that both have drawn, and of one that both have changed", () => {
    const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
    const { ann, ben, meet, undo } = apart(doc);
    connect(ann, a, b);
    connect(ben, a, b);
    meet();
    undo.undo();
    meet();
    expect(arrows(ben)).toEqual(["A>B"]);
    asOneEdit(ann, () => rootOf(ann, "relations").set(`${a}>${b}|on_true`, "stop"));
    asOneEdit(ben, () => rootOf(ben, "relations").set(`${a}>${b}|on_true`, "ignore"));
    meet();
    undo.undo();
    meet();
    expect(arrows(ben)).toEqual(["A>B"]);
  });

  test("of a note, of the bends of a line and of what is said of the graph", () => {
    const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
    connect(doc, a, b);
    const note = addNote(doc, '"old"');
    const bundle = `${a}>${b}|run`;
    const { ann, ben, meet, undo } = apart(doc);
    for (const [n, page] of [ann, ben].entries()) {
      asOneEdit(page, () => {
        setNote(page, note, `"${n}"`);
        setWaypoints(page, bundle, [[n, n]]);
        rootOf(page, "meta").set("description", `${n}`);
        rootOf(page, "comments").set("thread/message", `${n}`);
      });
    }
    meet();
    undo.undo();
    meet();
    expect(graphIn(ben).notes).toEqual([[note, '"1"']]);
    const values = mapsOf(ben);
    expect(values.positions.get(`w/${bundle}`)).toBe("[[1,1]]");
    expect(values.meta.get("description")).toBe("1");
    expect(values.comments.get("thread/message")).toBe("1");
  });
});

test("the newest of several values that lost comes back", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const { ann, ben, meet, undo } = apart(doc);
  setField(ann, a, "actor", "mine");
  setField(ann, a, "actor", "mine again");
  setField(ben, a, "actor", "theirs");
  setField(ben, a, "actor", "theirs again");
  meet();
  undo.undo();
  expect(actionIn(ann, a)?.actor).toBe("theirs again");
  undo.undo();
  expect(actionIn(ann, a)?.actor).toBe("theirs again");
});

test("a key that two people added stays when one takes it back, also if the other's value is unknown", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const { ann, ben, undo } = apart(doc);
  addParameter(ann, a, "in", "x", "1");
  addParameter(ben, a, "in", "x", "2");
  Y.applyUpdate(ben, Y.encodeStateAsUpdate(ann), "remote"); // here Ben's value is collected
  Y.applyUpdate(ann, Y.encodeStateAsUpdate(ben), "remote");
  undo.undo();
  expect(actionIn(ann, a)?.inputs.map(({ path }) => path)).toEqual(["x"]);
});

// -- one after the other ----------------------------------------------------------------------

test("a key that somebody deleted since stays deleted when an older change of it is taken back", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const { ann, ben, meet, undo } = apart(doc);
  rename(ann, a, "Mine");
  meet();
  removeActions(ben, [a]);
  meet();
  undo.undo();
  expect(names(ann)).toEqual([]);
  undo.redo();
  expect(names(ann)).toEqual([]);
});

test("taking a deletion back keeps what a colleague has written since, and making it anew does not take that", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  setField(doc, a, "description", "old");
  const { ann, ben, meet, undo } = apart(doc);
  removeActions(ann, [a]);
  setField(ben, a, "description", "new");
  meet();
  undo.undo();
  meet();
  expect(actionIn(ann, a)?.description).toBe("new");
  setField(ben, a, "actor", "theirs");
  meet();
  undo.redo();
  expect(actionIn(ann, a)).toMatchObject({ description: "new", actor: "theirs" });
});

test("an added action stays when a colleague has put something into it or drawn an arrow to it", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const { ann, ben, meet, undo } = apart(doc);
  const [b, c, d] = ["B", "C", "D"].map((name) => addAction(ann, { name, type: "sync" })) as [
    Key,
    Key,
    Key,
  ];
  meet();
  connect(ben, a, b);
  addParameter(ben, c, "in", "x", "1");
  meet();
  while (undo.canUndo()) undo.undo();
  meet();
  expect(names(ann)).toEqual(["A_0", "B_0", "C_0"]);
  expect(actionIn(ann, d)).toBeUndefined();
  expect(actionIn(ann, c)).toMatchObject({ type: "sync", inputs: [{ path: "x", text: "1" }] });
  expect(arrows(ann)).toEqual(["A>B"]);
});

test("a thread is taken back without the answer that a colleague gave", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const { ann, ben, meet, undo } = apart(doc);
  const author = { id: "1", name: "Ann" };
  const thread = beginThread(ann, a, { author, at: 1, text: "?" });
  meet();
  asOneEdit(ben, () => rootOf(ben, "comments").set(`${thread}/answer`, '{"text":"!"}'));
  meet();
  undo.undo();
  meet();
  expect(readThreads(mapsOf(ben).comments)).toEqual([]);
  expect(mapsOf(ben).comments.get(`${thread}/answer`)).toBe('{"text":"!"}');
});

// -- steps ------------------------------------------------------------------------------------

test("edits that follow one another fast are one step while that is asked for", () => {
  vi.useFakeTimers({ now: 1_000 });
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const { ann, ben, meet, undo } = apart(doc);
  setField(ann, a, "actor", "1");
  undo.captureTimeout = 900;
  setField(ann, a, "actor", "2");
  setField(ann, a, "description", "d");
  expect(undo.undoStack).toHaveLength(1);
  setField(ben, a, "actor", "theirs");
  meet();
  setField(ann, a, "actor", actionIn(ann, a)?.actor === "theirs" ? "3" : "theirs then 3");
  undo.undo();
  expect(actionIn(ann, a)?.actor).toBe("theirs");
  expect(actionIn(ann, a)?.description).toBe("");
  vi.useRealTimers();
});

test("a shared type that another client wrote into an action survives a deletion that is taken back", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const nested = new Y.Map<unknown>([["x", 1]]);
  rootOf(doc, "actions").set(`${a}|strange`, nested);
  const undo = undoOf(doc);
  removeActions(doc, [a]);
  expect(names(doc)).toEqual([]);
  undo.undo();
  expect(names(doc)).toEqual(["A_0"]);
  expect(rootOf(doc, "actions").get(`${a}|strange`)).toBe(nested);
  expect(nested.toJSON()).toEqual({ x: 1 });
});

// -- whatever people do -----------------------------------------------------------------------

interface Person {
  readonly doc: Y.Doc;
  readonly undo: ReturnType<typeof undoOf>;
  /** The values that others set, by place, with the time at which they came. */
  readonly others: Map<string, { at: number; value: unknown }[]>;
  /** The places that show what somebody else did last. */
  readonly theirs: Set<string>;
  readonly sent: Entry[];
  read: number;
}

interface Entry {
  readonly by: Person;
  readonly update: Uint8Array;
  readonly values: ReadonlyMap<string, unknown>;
}

const AID = "aaaaaaaaaaaa";
const LINE = `${AID}>bbbbbbbbbbbb`;
const PLACES: readonly (readonly [Root, string])[] = [
  ["meta", "description"],
  ["actions", `${AID}|actor`],
  ["actions", `${AID}|in/x`],
  ["relations", `${LINE}|on_true`],
  ["positions", AID],
  ["positions", "g/note"],
  ["positions", `w/${LINE}|run`],
  ["comments", "thread/message"],
];

/** All that a document holds, by place. */
function valuesIn(doc: Y.Doc): Map<string, unknown> {
  const maps = mapsOf(doc);
  return new Map(
    ROOTS.flatMap((root) => [...maps[root]].map(([key, value]) => [`${root} ${key}`, value])),
  );
}

type Move = readonly [person: number, kind: string, places: readonly number[]];
const KINDS = ["set", "set", "erase", "undo", "undo", "redo", "meet", "meet", "all meet"] as const;
/** Few places in each play, so that people get in each other's way. */
const plays = fc
  .uniqueArray(fc.nat(PLACES.length - 1), { minLength: 1, maxLength: 2 })
  .chain((few) =>
    fc.array(fc.tuple(fc.nat(2), fc.constantFrom(...KINDS), fc.subarray(few, { minLength: 1 })), {
      minLength: 6,
      maxLength: 40,
      size: "max",
    }),
  );

/** Plays moves of people who are apart until they meet, and looks at each undo and redo. */
function play(count: number, script: readonly Move[]): void {
  const log: Entry[] = [];
  const made = new WeakMap<UndoStep, { at: number; before: ReadonlyMap<string, unknown> }>();
  let now = 0;
  const people = Array.from({ length: count }, (_, n): Person => {
    const doc = new Y.Doc();
    doc.clientID = n + 1;
    const person = {
      doc,
      undo: undoOf(doc),
      others: new Map(),
      theirs: new Set<string>(),
      sent: [] as Entry[],
      read: 0,
    };
    doc.on("update", (update: Uint8Array, origin: unknown) => {
      if (origin !== "remote") person.sent.push({ by: person, update, values: valuesIn(doc) });
    });
    return person;
  });
  /** Sends what waits and takes what others have sent, as a room gives it out. */
  const meet = (person: Person) => {
    log.push(...person.sent.splice(0));
    for (const entry of log.slice(person.read)) {
      if (entry.by === person) continue;
      const before = valuesIn(person.doc);
      Y.applyUpdate(person.doc, entry.update, "remote");
      const after = valuesIn(person.doc);
      for (const place of differing(before, after)) person.theirs.add(place);
      const set = new Set<string>();
      for (const [place, value] of touched(entry)) {
        set.add(place);
        person.others.set(place, [...(person.others.get(place) ?? []), { at: now, value }]);
      }
      for (const place of before.keys()) {
        if (after.has(place) || set.has(place)) continue;
        person.others.set(place, [
          ...(person.others.get(place) ?? []),
          { at: now, value: undefined },
        ]);
      }
    }
    person.read = log.length;
  };
  const remember = (person: Person, before: ReadonlyMap<string, unknown>) => {
    for (const step of [...person.undo.undoStack, ...person.undo.redoStack]) {
      if (!made.has(step)) made.set(step, { at: now, before });
    }
  };
  for (const [who, kind, places] of script) {
    const person = people[who % count] as Person;
    const { doc, undo } = person;
    now += 1;
    const before = valuesIn(doc);
    if (kind === "meet") meet(person);
    else if (kind === "all meet") for (const _ of [1, 2]) people.forEach(meet);
    else if (kind === "undo" || kind === "redo") {
      const step = kind === "undo" ? undo.undo() : undo.redo();
      if (step !== null) judge(person, step, before, made.get(step));
    } else {
      asOneEdit(doc, () => {
        for (const n of places) {
          const [root, key] = PLACES[n] as readonly [Root, string];
          if (kind === "set") rootOf(doc, root).set(key, `${who % count}:${now}:${n}`);
          else rootOf(doc, root).delete(key);
        }
      });
    }
    if (!kind.endsWith("meet")) {
      for (const place of differing(before, valuesIn(doc))) person.theirs.delete(place);
    }
    remember(person, before);
  }
  for (const _ of [1, 2]) people.forEach(meet);
  for (const { doc } of people) expect(valuesIn(doc)).toEqual(valuesIn(people[0]?.doc as Y.Doc));
}

/** The places that hold something else, or nothing more. */
function differing(
  before: ReadonlyMap<string, unknown>,
  after: ReadonlyMap<string, unknown>,
): string[] {
  const places = new Set([...before.keys(), ...after.keys()]);
  return [...places].filter((place) => before.get(place) !== after.get(place));
}

/** The places that an entry sets, with their values, read from a document that holds nothing else of it. */
function touched({ update, values }: Entry): Map<string, unknown> {
  const found = new Map<string, unknown>();
  const { structs } = Y.decodeUpdate(update);
  for (const struct of structs) {
    if (!(struct instanceof Y.Item)) continue;
    const value = struct.content.getContent().at(-1);
    for (const [place, held] of values) if (held === value) found.set(place, value);
  }
  return found;
}

function judge(
  { doc, others, theirs: shown }: Person,
  step: UndoStep,
  before: ReadonlyMap<string, unknown>,
  info: { at: number; before: ReadonlyMap<string, unknown> } | undefined,
): void {
  if (info === undefined) throw new Error("a step that nobody made");
  const after = valuesIn(doc);
  for (const place of new Set([...before.keys(), ...after.keys(), ...step.keys.keys()])) {
    const since = (others.get(place) ?? []).filter(({ at }) => at > info.at);
    const [was, is, found] = [before.get(place), after.get(place), info.before.get(place)];
    if (!step.keys.has(place)) {
      expect(is, `${place} is none of this step`).toEqual(was);
    } else if (since.length === 0) {
      expect(is, `${place} is as it was before the step`).toEqual(found);
    } else {
      const theirs = since.map(({ value }) => value);
      if (shown.has(place)) expect(is, `${place} was set by somebody since`).toEqual(was);
      if (theirs.some((value) => value !== undefined) && was !== undefined) {
        expect(is, `${place} was added by somebody, too`).toBeDefined();
      }
      expect([was, found, ...theirs], `${place} has a value that somebody gave it`).toContain(is);
    }
  }
}

test.each([1, 2, 3])(
  "whatever %i people do at once, no undo takes away or writes over what it did not make",
  (count) => {
    fc.assert(
      fc.property(plays, (script) => play(count, script)),
      { numRuns: examples(150) },
    );
  },
);

// -- edits that the server makes for the person -------------------------------------------------

/** The server sets a document of another one's edits back, as a restore does, and the page adopts that. */
function restored(doc: Y.Doc, undo: ReturnType<typeof undoOf>, edit: (server: Y.Doc) => void) {
  const server = copyOf(doc);
  server.clientID = 3_000;
  const before = mapsOf(copyOf(server));
  edit(server);
  const after = mapsOf(copyOf(server));
  Y.applyUpdate(doc, Y.encodeStateAsUpdate(server), "remote");
  return () => undo.adopt(before, after);
}

test("a restore is undone and redone as the person's own edit, and the edit before it, too", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const undo = undoOf(doc);
  setField(doc, a, "actor", "first");
  setField(doc, a, "actor", "second");
  restored(doc, undo, (server) => {
    setField(server, a, "actor", "first");
    addAction(server, { name: "B" });
  })();
  undo.undo();
  expect(actionIn(doc, a)?.actor).toBe("second");
  expect(names(doc)).toHaveLength(1);
  undo.redo();
  expect(actionIn(doc, a)?.actor).toBe("first");
  expect(names(doc)).toHaveLength(2);
  undo.undo();
  undo.undo();
  expect(actionIn(doc, a)?.actor).toBe("first");
});

test("undoing a restore keeps what others have set since, also before it was known as a restore", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const undo = undoOf(doc);
  const theirs = (of: Key, actor: string) => {
    const other = copyOf(doc);
    setField(other, of, "actor", actor);
    Y.applyUpdate(doc, Y.encodeStateAsUpdate(other), "remote");
  };
  const adopt = restored(doc, undo, (server) => {
    for (const key of [a, b]) setField(server, key, "actor", "restored");
    setField(server, a, "description", "restored");
  });
  theirs(a, "theirs");
  adopt();
  theirs(b, "theirs");
  undo.undo();
  for (const key of [a, b]) expect(actionIn(doc, key)?.actor).toBe("theirs");
  expect(actionIn(doc, a)?.description).toBe("");
  expect(undo.canUndo()).toBe(false);
});
