import fc from "fast-check";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { addAction, rename, setField } from "../graph/edit";
import { graphNow } from "../graph/edit/document-writes";
import { FakeEditStore } from "../testing/fake-device";
import { FakeServer } from "../testing/fake-server";
import { GraphConnection, wouldLose } from "./graph-connection";

const ADA = { id: "a", name: "Ada" };

let server: FakeServer;
let device: FakeEditStore;
const visits: GraphConnection[] = [];

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("fetch", async () => Response.json({ person: ADA }));
  server = new FakeServer("one");
  device = new FakeEditStore();
});

afterEach(() => {
  for (const connection of visits.splice(0)) connection.leave();
  vi.useRealTimers();
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

const settle = () => vi.advanceTimersByTimeAsync(1);

async function come(): Promise<GraphConnection> {
  const connection = new GraphConnection({
    url: "ws://host/room",
    keep: { graph: "g", person: ADA, device },
    open: (url) => server.open(url),
  });
  visits.push(connection);
  await settle();
  return connection;
}

async function arrive(): Promise<void> {
  server.accept();
  await settle();
}

const docOf = (connection: GraphConnection) => connection.now().open.doc;
const names = (doc: Y.Doc) =>
  graphNow(doc)
    .actions.map(({ name }) => name)
    .sort();
const link = (connection: GraphConnection) => connection.now().open.room.link();

/** A server with what this one has now, as a backup brings it back. */
function backup(epoch: string): FakeServer {
  const copy = new FakeServer(epoch);
  Y.applyUpdate(copy.doc, Y.encodeStateAsUpdate(server.doc));
  copy.seq = server.seq;
  return copy;
}

test("a page names the history it knows, and the moment it has seen of it", async () => {
  const connection = await come();
  expect(new URL(server.last.url).search).toBe("?acks=1");
  await arrive();
  addAction(docOf(connection), { name: "Look" });
  await settle();
  server.last.end(1012);
  await vi.advanceTimersByTimeAsync(400);
  expect(new URL(server.last.url).search).toBe(`?acks=1&epoch=one&seq=${server.seq}`);
  await arrive();
  expect(link(connection).state).toBe("live");
});

test("after a restore with nothing waiting the page shows what the server has, and says so once", async () => {
  const connection = await come();
  await arrive();
  addAction(docOf(connection), { name: "Before" });
  await settle();
  const then = backup("two");
  addAction(docOf(connection), { name: "After" });
  await settle();
  server.last.end(1012);
  server = then;
  await vi.advanceTimersByTimeAsync(400);
  await arrive(); // sent away
  await arrive(); // the next room
  expect(link(connection)).toMatchObject({ state: "live", unsaved: 0 });
  expect(names(docOf(connection))).toEqual(["Before"]);
  expect(names(server.doc)).toEqual(["Before"]);
  expect(connection.now()).toMatchObject({ stranded: [], notice: "went-back" });
  connection.dismiss();
  expect(connection.now().notice).toBeNull();
});

/** Ada renames, adds and deletes while the server is away, which comes back from a backup. */
async function strand(connection: GraphConnection): Promise<{ kept: string; gone: string }> {
  await arrive();
  const kept = addAction(docOf(connection), { name: "Look" });
  const gone = addAction(docOf(connection), { name: "Gone" });
  await settle();
  const then = backup("two");
  addAction(docOf(connection), { name: "LostWithTheDisk" });
  await settle();
  server.last.end(1006);
  rename(docOf(connection), kept, "Watch");
  rename(docOf(connection), kept, "Peek");
  docOf(connection).getMap("actions").delete(gone);
  await settle();
  server = then;
  await vi.advanceTimersByTimeAsync(2_000);
  await arrive();
  await arrive();
  return { kept, gone };
}

test("edits that wait on the old history are laid aside with the values before and after", async () => {
  const connection = await come();
  const { kept, gone } = await strand(connection);
  expect(names(docOf(connection))).toEqual(["Gone", "Look"]);
  const [stranded] = connection.now().stranded;
  expect(stranded?.edits).toBe(3);
  expect(stranded?.before.actions.get(kept)).toBe("Look");
  expect(stranded?.difference.actions.get(kept)).toBe("Peek");
  expect(stranded?.before.actions.get(gone)).toBe("Gone");
  expect(stranded?.difference.actions.has(gone)).toBe(true);
  expect(stranded?.difference.actions.get(gone)).toBeUndefined();
  expect([...(stranded?.difference.actions.values() ?? [])]).not.toContain("LostWithTheDisk");
  expect(names(server.doc)).toEqual(["Gone", "Look"]);
});

test("the person takes some of the edits laid aside: these are stored, the rest is dropped", async () => {
  const connection = await come();
  const { kept } = await strand(connection);
  const [stranded] = connection.now().stranded;
  if (stranded === undefined) throw new Error("nothing waits");
  const chosen = { ...stranded.difference, actions: new Map([[kept, "Peek"]]) };
  expect(await connection.apply(stranded, chosen)).toBe(1);
  expect(names(server.doc)).toEqual(["Gone", "Peek"]);
  expect(connection.now().stranded).toEqual([]);
  expect(device.waiting).toBe(0);
  connection.now().open.undo.undo();
  await settle();
  expect(names(server.doc)).toEqual(["Gone", "Look"]);
});

test("a person who decides later can work on, and finds the same choice after closing the page", async () => {
  const first = await come();
  const { kept } = await strand(first);
  addAction(docOf(first), { name: "New" });
  await settle();
  first.leave();
  await settle();
  const again = await come();
  expect(names(docOf(again))).toEqual(["Gone", "Look", "New"]);
  await arrive();
  expect(link(again)).toMatchObject({ state: "live", unsaved: 0 });
  const [stranded] = again.now().stranded;
  expect(stranded?.edits).toBe(3);
  expect(stranded?.before.actions.get(kept)).toBe("Look");
  expect(stranded?.difference.actions.get(kept)).toBe("Peek");
  if (stranded) await again.drop(stranded);
  expect(again.now().stranded).toEqual([]);
  expect(device.waiting).toBe(0);
  expect(names(server.doc)).toEqual(["Gone", "Look", "New"]);
});

test("a server that went back without saying so is noticed, and gets another place on the device", async () => {
  const connection = await come();
  await arrive();
  addAction(docOf(connection), { name: "Before" });
  await settle();
  const then = backup("one");
  addAction(docOf(connection), { name: "Lost" });
  await settle();
  then.seq = server.seq + 5; // as if others had gone on
  server.last.end(1006);
  addAction(docOf(connection), { name: "Mine" });
  server = then;
  await vi.advanceTimersByTimeAsync(2_000);
  await arrive();
  await arrive();
  expect(link(connection).state).toBe("live");
  expect(names(docOf(connection))).toEqual(["Before"]);
  const [stranded] = connection.now().stranded;
  expect([...(stranded?.difference.actions.values() ?? [])]).toContain("Mine");
  expect(names(server.doc)).toEqual(["Before"]);
});

test("a page that shows something else than the server reports it and begins anew", async () => {
  vi.spyOn(console, "error").mockImplementation(() => undefined);
  const connection = await come();
  await arrive();
  addAction(docOf(connection), { name: "Look" });
  await vi.advanceTimersByTimeAsync(6_000);
  expect(server.divergences).toBe(0);
  expect(connection.now().notice).toBeNull();
  // Both say that they hold the same entries, which have other contents.
  Object.assign(server, { doc: twisted(server.doc) });
  server.broadcast((doc) => doc.getMap("meta").set("name", "renamed"));
  await vi.advanceTimersByTimeAsync(6_000);
  expect(server.divergences).toBe(1);
  await arrive();
  expect(link(connection)).toMatchObject({ state: "live", unsaved: 0 });
  expect(connection.now().notice).toBe("differed");
  expect(names(docOf(connection))).toEqual(["Twisted"]);
  await vi.advanceTimersByTimeAsync(10_000);
  expect(server.divergences).toBe(1);
});

/** A document with the same state vector in which the actions have another name. */
function twisted(doc: Y.Doc): Y.Doc {
  const text = Y.encodeStateAsUpdate(doc);
  const bytes = new TextDecoder("latin1").decode(text).replaceAll("w\x04Look", "w\x07Twisted");
  const copy = new Y.Doc();
  Y.applyUpdate(
    copy,
    Uint8Array.from(bytes, (letter) => letter.charCodeAt(0)),
  );
  return copy;
}

test("a page whose client id belongs to somebody else takes another and loses nothing", async () => {
  const connection = await come();
  await arrive();
  const action = addAction(docOf(connection), { name: "Look" });
  await settle();
  server.stalled = true;
  rename(docOf(connection), action, "Peek");
  const { clientID } = docOf(connection);
  server.lose();
  server.stalled = false;
  server.last.end(4403, "client id of another person");
  await settle();
  await arrive();
  await settle();
  expect(docOf(connection).clientID).not.toBe(clientID);
  expect(link(connection)).toMatchObject({ state: "live", unsaved: 0 });
  expect(names(server.doc)).toEqual(["Peek"]);
  expect(connection.now()).toMatchObject({ stranded: [], notice: null });
  expect(device.waiting).toBe(0);
});

test("edits that another page left on the same history are shown, not erased, after this page has decided", async () => {
  const first = await come();
  await arrive();
  const second = await come();
  await arrive();
  const then = backup("two");
  for (const socket of server.sockets) socket.end(1006);
  addAction(docOf(first), { name: "Mine" });
  addAction(docOf(second), { name: "Theirs" });
  await settle();
  second.leave();
  await settle();
  expect(device.waiting).toBe(2);
  server = then;
  await vi.advanceTimersByTimeAsync(2_000);
  await arrive();
  await arrive();
  const [mine] = first.now().stranded;
  expect(mine?.edits).toBe(1);
  if (mine) await first.drop(mine);
  const [theirs, ...more] = first.now().stranded;
  expect(more).toEqual([]);
  expect([...(theirs?.difference.actions.values() ?? [])]).toContain("Theirs");
  if (theirs) await first.drop(theirs);
  expect(first.now().stranded).toEqual([]);
  expect(device.waiting).toBe(0);
});

test("without a device, leaving the graph keeps its room open until the edits are stored", async () => {
  vi.spyOn(console, "warn").mockImplementation(() => undefined);
  device.refuses = true;
  const connection = await come();
  await arrive();
  server.last.end(1006);
  addAction(docOf(connection), { name: "Look" });
  await settle();
  connection.leave();
  expect(wouldLose(undefined)).toBe(true);
  await vi.advanceTimersByTimeAsync(2_000);
  await arrive();
  expect(names(server.doc)).toEqual(["Look"]);
  expect(wouldLose(undefined)).toBe(false);
  expect(server.last.readyState).toBe(3);
});

test("closing the page is asked about while what was laid aside is kept nowhere else", async () => {
  vi.spyOn(console, "warn").mockImplementation(() => undefined);
  device.refuses = true;
  const connection = await come();
  await strand(connection);
  expect(wouldLose(connection)).toBe(true);
  for (const stranded of connection.now().stranded) await connection.drop(stranded);
  expect(wouldLose(connection)).toBe(false);
});

test("a device that keeps nothing loses no choice while the page is open", async () => {
  vi.spyOn(console, "warn").mockImplementation(() => undefined);
  device.refuses = true;
  const connection = await come();
  const { kept } = await strand(connection);
  const [stranded] = connection.now().stranded;
  expect(stranded?.before.actions.get(kept)).toBe("Look");
  if (stranded) await connection.apply(stranded, stranded.difference).catch(() => undefined);
  expect(names(server.doc)).toEqual(["Peek"]);
});

// -- what the server refuses ------------------------------------------------------------------

/** Accepts every socket until all is quiet. */
async function comeAndGo(): Promise<void> {
  for (let n = 0; n < 40; n += 1) {
    if (server.last.readyState === 0) server.accept();
    await settle();
  }
}

/** Refuses every update that contains this text. */
function refuse(text: string, code: number): void {
  server.refuses = (update) => (new TextDecoder().decode(update).includes(text) ? code : null);
}

const refusals = [
  [1007, "not-accepted"],
  [1009, "not-accepted"],
  [4413, "full"],
] as const;

test.each(refusals)(
  "after %i everything else is stored, and what was refused is laid aside",
  async (code, refused) => {
    const connection = await come();
    await arrive();
    refuse("Cursed", code);
    server.last.end(1006); // several edits go at once
    addAction(docOf(connection), { name: "First" });
    const cursed = addAction(docOf(connection), { name: "Cursed" });
    setField(docOf(connection), cursed, "description", "builds on it");
    addAction(docOf(connection), { name: "Second" });
    await vi.advanceTimersByTimeAsync(400);
    await comeAndGo();
    expect(names(server.doc)).toEqual(["First", "Second"]);
    expect(link(connection)).toMatchObject({ state: "live", unsaved: 0 });
    const [stranded, ...more] = connection.now().stranded;
    expect(more).toEqual([]);
    expect(stranded).toMatchObject({ refused, edits: 2 });
    expect(stranded?.difference.actions.get(cursed)).toBe("Cursed");
    expect(stranded?.difference.actions.get(`${cursed}|description`)).toBe("builds on it");
    addAction(docOf(connection), { name: "Third" });
    await settle();
    expect(names(server.doc)).toEqual(["First", "Second", "Third"]);
    expect(device.waiting).toBe(2);
  },
);

test("choices between two values stay open when an edit is refused, also after a reload", async () => {
  const first = await come();
  await arrive();
  const look = addAction(docOf(first), { name: "Look" });
  await comeAndGo();
  refuse("Cursed", 1007);
  server.last.end(1006);
  setField(docOf(first), look, "description", "mine");
  addAction(docOf(first), { name: "Cursed" });
  server.broadcast((doc) => setField(doc, look, "description", "theirs"));
  await vi.advanceTimersByTimeAsync(400);
  await comeAndGo();
  expect(link(first)).toMatchObject({ state: "live", unsaved: 0 });
  expect(first.now().stranded).toMatchObject([{ refused: "not-accepted", edits: 1 }]);
  const values = (connection: GraphConnection) =>
    connection
      .now()
      .open.room.changedTwice.now()
      .map(({ mine, theirs }) => [mine, theirs]);
  expect(values(first)).toEqual([["mine", "theirs"]]);
  first.leave();
  await settle();
  const second = await come();
  await comeAndGo();
  expect(values(second)).toEqual([["mine", "theirs"]]);
  const { changedTwice } = second.now().open.room;
  for (const each of changedTwice.now()) changedTwice.choose(each, "theirs");
  await comeAndGo();
  expect(docOf(second).getMap("actions").get(`${look}|description`)).toBe("theirs");
});

test("an edit that is refused alone is laid aside at once, and the next ones are stored", async () => {
  const connection = await come();
  await arrive();
  refuse("Cursed", 1009);
  for (const name of ["First", "Cursed", "Second", "Cursed too", "Third"]) {
    addAction(docOf(connection), { name });
    await comeAndGo();
  }
  expect(names(server.doc)).toEqual(["First", "Second", "Third"]);
  expect(connection.now().stranded.map(({ edits }) => edits)).toEqual([1, 1]);
});

test("a refused edit can be made once the server takes it, and stays until then", async () => {
  const connection = await come();
  await arrive();
  refuse("Cursed", 4413);
  addAction(docOf(connection), { name: "Cursed" });
  await comeAndGo();
  const [stranded] = connection.now().stranded;
  if (stranded === undefined) throw new Error("nothing waits");
  const failed = connection.apply(stranded, stranded.difference).catch((error: Error) => error);
  await comeAndGo();
  expect(await failed).toBeInstanceOf(Error);
  expect(connection.now().stranded).toEqual([stranded]);
  expect(link(connection)).toMatchObject({ state: "live", unsaved: 0 });
  server.refuses = () => null;
  await connection.apply(stranded, stranded.difference);
  expect(names(server.doc)).toEqual(["Cursed"]);
  expect(connection.now().stranded).toEqual([]);
  expect(device.waiting).toBe(0);
});

test("after a reload what was refused is shown, and does not block either", async () => {
  const first = await come();
  await arrive();
  refuse("Cursed", 1009);
  server.last.end(1006);
  for (const name of ["First", "Cursed", "Second"]) addAction(docOf(first), { name });
  await settle();
  first.leave(); // before anything was sent
  const second = await come();
  await comeAndGo();
  expect(names(server.doc)).toEqual(["First", "Second"]);
  expect(second.now().stranded).toMatchObject([{ refused: "not-accepted", edits: 1 }]);
  second.leave();
  await settle();
  const third = await come();
  await comeAndGo();
  expect(third.now().stranded).toMatchObject([{ refused: "not-accepted", edits: 1 }]);
  addAction(docOf(third), { name: "Third" });
  await comeAndGo();
  expect(names(server.doc)).toEqual(["First", "Second", "Third"]);
});

test("a message that is no edit and is refused each time is not sent for ever", async () => {
  const connection = await come();
  await arrive();
  for (let n = 0; n < 3; n += 1) {
    server.last.end(1007);
    await comeAndGo();
    expect(link(connection).state).toBe("live");
  }
  server.last.end(1007);
  await comeAndGo();
  expect(link(connection)).toMatchObject({ state: "refused", why: "not-accepted" });
});

test("all other edits are stored and none is lost, whichever edits are refused", async () => {
  const edits = fc.array(fc.tuple(fc.boolean(), fc.boolean()), { minLength: 1, maxLength: 6 });
  await fc.assert(
    fc.asyncProperty(edits, async (script) => {
      server = new FakeServer("one");
      device = new FakeEditStore();
      refuse("Cursed", 1009);
      const connection = await come();
      await arrive();
      for (const [n, [isCursed, waits]] of script.entries()) {
        addAction(docOf(connection), { name: `${isCursed ? "Cursed" : "Good"} ${n}` });
        if (waits) await comeAndGo();
      }
      await comeAndGo();
      const made = script.map(([isCursed], n) => `${isCursed ? "Cursed" : "Good"} ${n}`);
      expect(names(server.doc)).toEqual(made.filter((name) => name.startsWith("Good")));
      const aside = connection
        .now()
        .stranded.flatMap(({ difference }) =>
          [...difference.actions.values()].filter((value) => `${value}`.startsWith("Cursed")),
        );
      expect(aside.sort()).toEqual(made.filter((name) => name.startsWith("Cursed")));
      connection.leave();
    }),
    { numRuns: 25 },
  );
});
