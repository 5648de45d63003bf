import fc from "fast-check";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { addAction, rename, setGraphName } from "../graph/edit";
import { FakeEditStore } from "../testing/fake-device";
import { FakeServer } from "../testing/fake-server";
import { applyDifference, differenceOf } from "./replaced-history";
import { connectRoom, type Room } from "./room-connection";

const ADA = { id: "a", name: "Ada" };
const MARI = { id: "m", name: "Mari" };

let server: FakeServer;
let device: FakeEditStore;
const rooms: Room[] = [];

beforeEach(() => {
  vi.useFakeTimers();
  server = new FakeServer();
  device = new FakeEditStore();
});

afterEach(() => {
  for (const room of rooms.splice(0)) room.close();
  vi.useRealTimers();
  vi.restoreAllMocks();
});

const settle = () => vi.advanceTimersByTimeAsync(0);

async function open(person = ADA, more: { epoch?: string; graph?: string } = {}): Promise<Room> {
  const room = connectRoom({
    url: "ws://host/room",
    open: server.open,
    random: () => 1,
    keep: { graph: "g", person, device, ...more },
  });
  rooms.push(room);
  await settle();
  return room;
}

/** The tab goes without a word. */
async function vanish(room: Room): Promise<void> {
  await settle();
  room.close();
  await settle();
}

const write = (doc: Y.Doc, key: string, value: unknown = 1) => doc.getMap("meta").set(key, value);
const keys = (doc: Y.Doc) => [...doc.getMap("meta").keys()].sort();

test("edits that wait survive closing the page, count at once, and go on return", async () => {
  const first = await open();
  write(first.doc, "a");
  write(first.doc, "b");
  await settle();
  expect(first.link()).toMatchObject({ unsaved: 2, kept: true });
  await vanish(first);
  const second = await open();
  expect(second.link()).toMatchObject({ state: "connecting", unsaved: 2, kept: true });
  expect(keys(second.doc)).toEqual(["a", "b"]);
  server.accept();
  await settle();
  expect(second.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(server.doc)).toEqual(["a", "b"]);
  expect(device.waiting).toBe(0);
});

test("an edit leaves the device only when the server has stored it", async () => {
  const room = await open();
  server.accept();
  server.stalled = true;
  write(room.doc, "a");
  await settle();
  expect(device.waiting).toBe(1);
  server.commit();
  await settle();
  expect(device.waiting).toBe(0);
});

test("a graph that was open before opens without a server, at the moment it last showed", async () => {
  write(server.doc, "theirs");
  server.seq = 7;
  const first = await open();
  server.accept();
  write(first.doc, "mine");
  await settle();
  await vanish(first);
  const second = await open();
  server.last.end(1006);
  expect(second.link()).toMatchObject({ state: "offline", unsaved: 0, seq: 8 });
  expect(keys(second.doc)).toEqual(["mine", "theirs"]);
});

test("an edit that builds on a colleague's is whole after closing the page", async () => {
  const first = await open();
  server.accept();
  server.broadcast((doc) => write(doc, "name", "theirs"));
  server.last.end(1006);
  write(first.doc, "name", "mine");
  await vanish(first);
  const second = await open();
  expect(second.doc.getMap("meta").get("name")).toBe("mine");
  expect(second.doc.store.pendingStructs).toBeNull();
});

test("values to choose between survive a reload and a closed tab, until each was chosen or dismissed", async () => {
  const first = await open();
  server.accept();
  server.last.end(1006);
  const fields = ["a", "b", "c"];
  for (const key of fields) write(first.doc, key, "mine");
  server.broadcast((doc) => {
    for (const key of fields) write(doc, key, "theirs");
  });
  await vi.advanceTimersByTimeAsync(300);
  server.accept();
  const ids = (room: Room) => room.changedTwice.now().map(({ key }) => key);
  expect(ids(first)).toEqual(fields);
  await vanish(first);
  const second = await open();
  expect(ids(second)).toEqual(fields);
  const [a] = second.changedTwice.now();
  if (a === undefined) throw new Error("nothing to choose");
  server.accept();
  second.changedTwice.choose(a, "mine");
  second.changedTwice.choose(a, "theirs");
  expect(server.doc.getMap("meta").get("a")).toBe("theirs");
  expect(ids(second)).toEqual(fields); // until the list is closed
  await vanish(second);
  const third = await open();
  expect(ids(third)).toEqual(["b", "c"]);
  expect(ids(await open(MARI))).toEqual([]);
  await device.leave(ADA.id);
  expect(ids(await open())).toEqual(["b", "c"]);
  third.changedTwice.dismiss();
  await vanish(third);
  expect(ids(await open())).toEqual([]);
});

test("a value of an earlier visit that was replaced unseen is told", async () => {
  const first = await open();
  server.accept();
  write(first.doc, "a", "mine");
  await vanish(first);
  const second = await open();
  server.accept();
  const other = new Y.Doc();
  other.clientID = 2 ** 32 - 1; // above any: this value stands
  write(other, "a", "theirs");
  server.broadcast((doc) => Y.applyUpdate(doc, Y.encodeStateAsUpdate(other)));
  expect(second.changedTwice.now()).toMatchObject([
    { key: "a", mine: "mine", theirs: "theirs", cause: "unseen" },
  ]);
});

test("edits never go under another name, and the person they wait for is known", async () => {
  const ada = await open(ADA);
  write(ada.doc, "of ada");
  await vanish(ada);
  const mari = await open(MARI);
  server.accept();
  await settle();
  expect(mari.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(mari.doc)).toEqual([]);
  expect(keys(server.doc)).toEqual([]);
  expect(await device.others({ graph: "g", person: MARI })).toEqual([{ ...ADA, waiting: 1 }]);
  await vanish(mari);
  await open(ADA);
  server.accept();
  expect(keys(server.doc)).toEqual(["of ada"]);
});

test("each graph has its own edits", async () => {
  const one = await open(ADA, { graph: "one" });
  write(one.doc, "of one");
  await vanish(one);
  expect(keys((await open(ADA, { graph: "two" })).doc)).toEqual([]);
});

test("a device that refuses is said, and nothing else suffers", async () => {
  const noise = vi.spyOn(console, "warn").mockImplementation(() => undefined);
  device.refuses = true;
  const room = await open();
  server.accept();
  server.stalled = true;
  write(room.doc, "a");
  await settle();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 1, kept: false });
  server.commit();
  expect(room.link()).toMatchObject({ unsaved: 0 });
  expect(keys(server.doc)).toEqual(["a"]);
  expect(noise).toHaveBeenCalled();
});

test("a full device is said at once, and tried again", async () => {
  vi.spyOn(console, "warn").mockImplementation(() => undefined);
  const room = await open();
  device.refuses = true;
  write(room.doc, "a");
  expect(room.link().kept).toBe(false);
  await settle();
  expect(room.link().kept).toBe(false);
  device.refuses = false;
  await vi.advanceTimersByTimeAsync(10_000);
  expect(room.link()).toMatchObject({ unsaved: 1, kept: true });
  expect(device.waiting).toBe(1);
});

test("a device that hangs holds nobody up, and what it says late is still sent", async () => {
  const first = await open();
  write(first.doc, "kept");
  await vanish(first);
  let answer = () => {};
  device.ready = new Promise((resolve) => {
    answer = resolve;
  });
  const second = await open();
  write(second.doc, "new");
  const before = server.sockets.length;
  await vi.advanceTimersByTimeAsync(3_000);
  expect(server.sockets.length).toBe(before + 1);
  server.accept();
  expect(keys(server.doc)).toEqual(["new"]);
  answer();
  await settle();
  expect(second.link().unsaved).toBe(1);
  server.accept();
  await settle();
  expect(keys(server.doc)).toEqual(["kept", "new"]);
  expect(device.waiting).toBe(0);
});

test("many edits are few writes, and long histories become one copy", async () => {
  const room = await open();
  for (let n = 0; n < 500; n += 1) write(room.doc, `k${n}`);
  await settle();
  expect(device.waiting).toBe(500);
  expect(device.writes).toBeLessThan(5);
  server.accept();
  await vi.advanceTimersByTimeAsync(5_000);
  expect(device.waiting).toBe(0);
  expect(device.entries[0]?.known.length).toBeLessThan(3);
});

test("a backlog that is too large for one message goes in pieces", async () => {
  const first = await open();
  for (let n = 0; n < 20; n += 1) write(first.doc, `k${n}`, "x".repeat(100_000));
  await vanish(first);
  const second = await open();
  const socket = server.accept();
  await settle();
  expect(second.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(server.doc).length).toBe(20);
  expect(Math.max(...socket.received.map((data) => data.length))).toBeLessThan(1 << 20);
});

// -- other histories ------------------------------------------------------------------------------

/** Replaces the server by one that has an older document, as after a restore. */
function restored(update: Uint8Array): void {
  const { seq } = server;
  server = new FakeServer();
  server.seq = seq;
  Y.applyUpdate(server.doc, update);
}

test("a server that went back gets nothing merged into it; the edits wait for a decision", async () => {
  const room = await open();
  server.accept();
  const action = addAction(room.doc, { name: "Scan" });
  const backup = Y.encodeStateAsUpdate(server.doc);
  addAction(room.doc, { name: "Lost with the disk" });
  server.last.end(1006);
  rename(room.doc, action, "Look");
  setGraphName(room.doc, "mine");
  await vanish(room);
  restored(backup);
  const back = await open();
  server.accept();
  expect(back.link()).toMatchObject({ state: "refused", why: "other-epoch", unsaved: 2 });
  expect(mapsOf(server.doc).actions).toEqual(mapsOf(docOf(backup)).actions);
  const stranded = back.stranded();
  expect(stranded?.edits).toBe(2);
  expect(stranded?.difference.actions.get(action)).toBe("Look");
  expect([...(stranded?.difference.meta ?? [])]).toEqual([["name", "mine"]]);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(server.sockets.length).toBe(1);

  const fresh = await open(ADA, { epoch: "0~anew" });
  server.accept();
  if (stranded) applyDifference(fresh.doc, stranded.difference);
  await settle();
  await back.forget();
  expect(fresh.link()).toMatchObject({ state: "live", unsaved: 0 });
  const graph = mapsOf(server.doc);
  expect(graph.actions.get(action)).toBe("Look");
  expect([...graph.actions.values()]).not.toContain("Lost with the disk");
  expect(device.waiting).toBe(0);
  await vanish(fresh);
  expect((await open()).doc.getMap("actions").get(action)).toBe("Look");
});

test("erased keys are part of what waits", async () => {
  const room = await open();
  server.accept();
  const backup = Y.encodeStateAsUpdate(server.doc);
  write(room.doc, "kept");
  write(room.doc, "erased");
  server.last.end(1006);
  room.doc.getMap("meta").delete("erased");
  restored(backup);
  await vanish(room);
  const back = await open();
  server.accept();
  expect([...(back.stranded()?.difference.meta ?? [])]).toEqual([["erased", undefined]]);
});

test("edits that were dropped are gone, and the graph opens as the server has it", async () => {
  const room = await open();
  server.accept();
  write(room.doc, "durable");
  server.last.end(1006);
  write(room.doc, "waits");
  restored(new Uint8Array([0, 0]));
  await vanish(room);
  const back = await open();
  server.accept();
  expect(back.link().why).toBe("other-epoch");
  await back.forget();
  await vanish(back);
  const fresh = await open();
  server.accept();
  expect(fresh.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(fresh.doc)).toEqual([]);
});

test("a server that only lacks what was never acknowledged has the same history", async () => {
  const room = await open();
  server.accept();
  server.stalled = true;
  write(room.doc, "a");
  write(room.doc, "b");
  server.lose();
  server.last.end(1006);
  server.stalled = false;
  await vanish(room);
  const back = await open();
  server.accept();
  expect(back.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(server.doc)).toEqual(["a", "b"]);
});

function docOf(update: Uint8Array): Y.Doc {
  const doc = new Y.Doc();
  Y.applyUpdate(doc, update);
  return doc;
}

const plain = fc.dictionary(
  fc.constantFrom("name", "description", "x/a", "x/b"),
  fc.oneof(fc.string(), fc.integer(), fc.boolean()),
);

test("the difference of two documents, applied to the first, makes the second", () => {
  fc.assert(
    fc.property(plain, plain, (left, right) => {
      const [before, after] = [new Y.Doc(), new Y.Doc()];
      for (const [key, value] of Object.entries(left)) write(before, key, value);
      for (const [key, value] of Object.entries(right)) write(after, key, value);
      applyDifference(before, differenceOf(before, after));
      expect(mapsOf(before)).toEqual(mapsOf(after));
      expect(applyDifference(before, differenceOf(before, after))).toBe(0);
    }),
  );
});

// -- anything at any time -------------------------------------------------------------------------

const steps = fc.constantFrom(
  ...(["edit", "edit", "colleague", "stall", "commit", "drop", "crash", "accept"] as const),
  ...(["reload", "reload", "wait", "full"] as const),
);

test("no stored edit is lost, whatever breaks and however often the page is closed", async () => {
  vi.spyOn(console, "warn").mockImplementation(() => undefined);
  await fc.assert(
    fc.asyncProperty(fc.array(steps, { maxLength: 40 }), async (script) => {
      server = new FakeServer();
      device = new FakeEditStore();
      let room = await open();
      let mine: string[] = [];
      const isOpen = () => server.last.readyState === 1;
      for (const [n, step] of script.entries()) {
        if (step === "edit") {
          mine.push(`mine ${n}`);
          write(room.doc, `mine ${n}`);
        } else if (step === "colleague" && isOpen()) {
          server.broadcast((doc) => write(doc, `theirs ${n}`));
        } else if (step === "stall") server.stalled = true;
        else if (step === "commit") server.commit();
        else if (step === "accept" && server.last.readyState === 0) server.accept();
        else if (step === "wait") await vi.advanceTimersByTimeAsync(10_000);
        else if (step === "full") device.refuses = !device.refuses;
        else if (step === "drop" && isOpen()) server.last.end(1006);
        else if (step === "crash" && isOpen()) {
          server.lose();
          server.last.end(1006);
        } else if (step === "reload") {
          await settle();
          const { unsaved, kept } = room.link();
          const stored = new Set(keys(server.doc));
          server.lose();
          room.close();
          if (!kept) mine = mine.filter((key) => stored.has(key));
          device.refuses = false;
          await settle();
          room = await open();
          if (kept) expect(room.link().unsaved).toBeGreaterThanOrEqual(unsaved);
        }
        const stored = new Set(keys(server.doc));
        const lacking = mine.filter((key) => !stored.has(key));
        expect(room.link().unsaved).toBeGreaterThanOrEqual(lacking.length);
      }
      device.refuses = false;
      server.stalled = false;
      server.commit();
      room.reconnect();
      server.accept();
      await vi.advanceTimersByTimeAsync(20_000);
      expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
      expect(keys(room.doc)).toEqual(keys(server.doc));
      expect(keys(server.doc)).toEqual(expect.arrayContaining(mine));
      expect(device.waiting).toBe(0);
      room.close();
    }),
    { numRuns: 150 },
  );
});
