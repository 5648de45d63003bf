import fc from "fast-check";
import * as encoding from "lib0/encoding";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type * as Y from "yjs";
import { asOneEdit, undoOf } from "../graph/edit";
import { eraseKeys, writeKey } from "../graph/edit/document-writes";
import { FakeServer, statesSent } from "../testing/fake-server";
import { Away } from "./room";
import { connectRoom, type RefusalReason, type Room, roomUrl } from "./room-connection";

let server: FakeServer;
let room: Room;

beforeEach(() => {
  vi.useFakeTimers();
  server = new FakeServer();
  room = connectRoom({ url: "ws://host/api/graphs/g/room", open: server.open, random: () => 1 });
});

afterEach(() => {
  room.close();
  vi.useRealTimers();
});

const write = (key: string, doc: Y.Doc = room.doc) => doc.getMap("meta").set(key, 1);
const keys = (doc: Y.Doc) => [...doc.getMap("meta").keys()].sort();

test("a room asks for acknowledgements, syncs and is live at the server's moment", () => {
  write("theirs", server.doc);
  server.seq = 7;
  expect(room.link()).toEqual({ state: "connecting", unsaved: 0, seq: 0 });
  server.accept();
  expect(server.last.url).toBe("ws://host/api/graphs/g/room?acks=1");
  expect(room.link()).toEqual({ state: "live", unsaved: 0, seq: 7 });
  expect(keys(room.doc)).toEqual(["theirs"]);
});

test("an edit is unsaved until the server says that it is durable, not merely taken", () => {
  server.accept();
  server.stalled = true;
  write("a");
  write("b");
  expect(room.link()).toMatchObject({ state: "live", unsaved: 2, seq: 0 });
  server.commit();
  expect(room.link()).toMatchObject({ unsaved: 0, seq: 2 });
  expect(keys(server.doc)).toEqual(["a", "b"]);
});

test("edits made before the first sync are merged and counted", () => {
  write("theirs", server.doc);
  write("early");
  expect(room.link()).toMatchObject({ state: "connecting", unsaved: 1 });
  server.accept();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(room.doc)).toEqual(["early", "theirs"]);
  expect(keys(server.doc)).toEqual(["early", "theirs"]);
});

test("edits made while offline wait, count, and arrive on return", () => {
  server.accept();
  server.last.end(1006);
  expect(room.link()).toMatchObject({ state: "offline", unsaved: 0 });
  write("a");
  write("b");
  expect(room.link()).toMatchObject({ state: "offline", unsaved: 2 });
  vi.advanceTimersByTime(300);
  server.accept();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(server.doc)).toEqual(["a", "b"]);
});

test("an edit that was sent but not acknowledged when the connection broke is sent again", () => {
  server.accept();
  server.stalled = true;
  write("a");
  server.last.end(1006);
  const lost = server; // the server dies with what it had not committed
  server = new FakeServer();
  expect(keys(lost.doc)).toEqual([]);
  expect(room.link().unsaved).toBe(1);
  vi.advanceTimersByTime(300);
  // the client dials the address it knows; hand its socket to the new process
  const socket = lost.last;
  server.sockets.push(socket);
  Object.assign(socket, { server });
  server.accept();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(keys(server.doc)).toEqual(["a"]);
});

test("an update goes only after the room was given what it lacked, so that it never waits there", () => {
  write("early");
  const socket = server.last;
  socket.readyState = 1;
  socket.onopen?.();
  write("later");
  const documentMessages = () => socket.received.filter((data) => data[0] === 0 && data[1] !== 0);
  expect(documentMessages()).toEqual([]);
  expect(room.link().unsaved).toBe(2);
  server.accept();
  expect(keys(server.doc)).toEqual(["early", "later"]);
  expect(server.doc.store.pendingStructs).toBeNull();
});

/** Two edits of more than a message may have: much that is added, and the same brought back by undo. */
function changeMuch(doc: Y.Doc): void {
  const undo = undoOf(doc);
  const values = (value: string) => {
    for (let n = 0; n < 3_000; n += 1) writeKey(doc, "actions", `${n}`, value.repeat(500));
  };
  asOneEdit(doc, () => values("a"));
  asOneEdit(doc, () => {
    for (let n = 0; n < 3_000; n += 1) eraseKeys(doc, "actions", `${n}`);
  });
  undo.undo();
}

test("an edit above the size of a message goes in pieces, and counts as stored after the last one", () => {
  server.accept();
  server.stalled = true;
  changeMuch(room.doc);
  expect(room.link().unsaved).toBe(3);
  const sent = () => server.last.received.filter((data) => data[0] === 0 && data[1] === 2);
  expect(sent().length).toBeGreaterThan(6);
  expect(Math.max(...sent().map(({ length }) => length))).toBeLessThan(1 << 19);
  server.stalled = false;
  server.commit();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(server.doc.getMap("actions").size).toBe(3_000);
  write("next");
  expect(room.link().unsaved).toBe(0);
  expect(keys(server.doc)).toEqual(["next"]);
});

test("an edit above the size of a message goes in pieces also after a time offline", () => {
  server.accept();
  server.last.end(1006);
  changeMuch(room.doc);
  vi.advanceTimersByTime(300);
  server.accept();
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(server.doc.getMap("actions").size).toBe(3_000);
  expect(server.doc.store.pendingStructs).toBeNull();
});

const steps = fc.constantFrom(
  ...(["edit", "edit", "colleague", "stall", "commit", "drop", "crash", "accept", "wait"] as const),
);

test("no edit is called saved that the server lacks, and in the end both agree, whatever breaks", () => {
  fc.assert(
    fc.property(fc.array(steps, { maxLength: 40 }), (script) => {
      const server = new FakeServer();
      const room = connectRoom({ url: "ws://host/room", open: server.open, random: () => 1 });
      const isOpen = () => server.last.readyState === 1;
      const mine: string[] = [];
      script.forEach((step, n) => {
        if (step === "edit") {
          mine.push(`mine ${n}`);
          write(`mine ${n}`, room.doc);
        } else if (step === "colleague" && isOpen()) {
          server.broadcast((doc) => write(`theirs ${n}`, doc));
        } else if (step === "stall") server.stalled = true;
        else if (step === "commit") server.commit();
        else if (step === "accept" && server.last.readyState === 0) server.accept();
        else if (step === "wait") vi.advanceTimersByTime(10_000);
        else if (step === "drop" && isOpen()) server.last.end(1006);
        else if (step === "crash" && isOpen()) {
          server.lose();
          server.last.end(1006);
        }
        const stored = new Set(keys(server.doc));
        const lacking = mine.filter((key) => !stored.has(key));
        expect(room.link().unsaved).toBeGreaterThanOrEqual(lacking.length);
      });
      server.stalled = false;
      server.commit();
      if (!isOpen()) {
        room.reconnect();
        server.accept();
      }
      expect(room.link()).toMatchObject({ state: "live", unsaved: 0, seq: server.seq });
      expect(keys(room.doc)).toEqual(keys(server.doc));
      expect(keys(server.doc)).toEqual(expect.arrayContaining(mine));
      room.close();
    }),
    { numRuns: 300 },
  );
});

test("changes by others advance the moment and are not counted as one's own", () => {
  server.accept();
  server.broadcast((doc) => write("theirs", doc));
  expect(room.link()).toEqual({ state: "live", unsaved: 0, seq: 1 });
  expect(keys(room.doc)).toEqual(["theirs"]);
});

test("what has come from the room is not encoded again, and an edit that answers it is sent", () => {
  server.accept();
  const encoded: (readonly [own: boolean, boolean])[] = [];
  room.doc.on("afterTransactionCleanup", ({ local }: Y.Transaction, doc: Y.Doc) => {
    encoded.push([local, doc._observers.has("update")]);
  });
  room.doc.on("afterTransaction", ({ local }: Y.Transaction) => {
    if (!local) write("answer");
  });
  server.broadcast((doc) => write("theirs", doc));
  expect(encoded).toEqual([
    [false, false],
    [true, true],
  ]);
  expect(keys(server.doc)).toEqual(["answer", "theirs"]);
  expect(room.link()).toMatchObject({ state: "live", unsaved: 0 });
});

test.each([
  [4401, "session-ended"],
  [4403, "forbidden"],
  [4404, "no-such-graph"],
  [4409, "other-epoch"],
  [1009, "not-accepted"],
])("after %i the room stays away until it is told to come again", (code, why) => {
  server.accept();
  server.last.end(code);
  expect(room.link()).toMatchObject({ state: "refused", why });
  vi.advanceTimersByTime(3_600_000);
  expect(server.sockets.length).toBe(1);
  room.reconnect();
  expect(room.link()).toEqual({ state: "connecting", unsaved: 0, seq: 0 });
  server.accept();
  expect(room.link()).toEqual({ state: "live", unsaved: 0, seq: 0 });
});

test.each([
  [1012, "restarting"],
  [1013, "too-slow"],
  [4503, "not-stored"],
])("after %i the room comes back by itself", (code, why) => {
  server.accept();
  server.last.end(code);
  expect(room.link()).toMatchObject({ state: "offline", why });
  vi.advanceTimersByTime(300);
  server.accept();
  expect(room.link()).toEqual({ state: "live", unsaved: 0, seq: 0 });
});

test("a room asks at the door before each attempt, and stays away with the reason", async () => {
  const answers: (RefusalReason | null | Error)[] = [
    new Error("nobody answers"),
    null,
    "other-person",
  ];
  const asked: boolean[] = [];
  const own = new FakeServer();
  const other = connectRoom({
    url: "ws://host/room",
    open: own.open,
    random: () => 1,
    admit: async (again) => {
      asked.push(again);
      const answer = answers.shift() ?? null;
      if (answer instanceof Error) throw answer;
      return answer;
    },
  });
  await vi.advanceTimersByTimeAsync(0);
  expect(own.sockets.length).toBe(0);
  expect(other.link().state).toBe("offline");
  await vi.advanceTimersByTimeAsync(300);
  own.accept();
  expect(other.link().state).toBe("live");
  own.last.end(1006);
  await vi.advanceTimersByTimeAsync(300);
  expect(other.link()).toMatchObject({ state: "refused", why: "other-person" });
  expect(asked).toEqual([false, true, true]);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(own.sockets.length).toBe(1);
  other.close();
});

test("a socket that is silent for half a minute is given up; one that beats is kept", () => {
  const socket = server.accept();
  for (let n = 0; n < 10; n += 1) {
    vi.advanceTimersByTime(15_000);
    server.presence(0, 0, null);
  }
  expect(server.sockets.length).toBe(1);
  vi.advanceTimersByTime(32_000);
  expect(socket.readyState).toBe(3);
  expect(server.sockets.length).toBe(2);
});

test("a socket that never opens is given up", () => {
  vi.advanceTimersByTime(12_000);
  expect(server.sockets.length).toBe(2);
  expect(room.link().state).toBe("offline");
});

test("a message that cannot be read ends the socket and harms nothing else", () => {
  const noise = vi.spyOn(console, "error").mockImplementation(() => undefined);
  const socket = server.accept();
  socket.deliver(new Uint8Array([0, 2, 5, 1]));
  expect(noise).toHaveBeenCalledOnce();
  expect(room.link().state).toBe("offline");
  vi.advanceTimersByTime(300);
  server.accept();
  server.last.deliver(new Uint8Array([77, 1, 2])); // a kind that we do not know
  expect(room.link().state).toBe("live");
  noise.mockRestore();
});

test("a graph that can only be read says why, until a socket comes without that", () => {
  const socket = server.accept();
  const encoder = encoding.createEncoder();
  encoding.writeVarUint(encoder, 102);
  encoding.writeVarString(encoder, "change 12 is damaged");
  socket.deliver(encoding.toUint8Array(encoder));
  expect(room.link()).toMatchObject({ state: "live", readOnly: "change 12 is damaged" });
  socket.end(1006);
  vi.advanceTimersByTime(300);
  server.accept();
  expect(room.link()).not.toHaveProperty("readOnly");
});

test("others are out of sight while offline, and back on return with the clock they had", () => {
  server.accept();
  server.presence(5, 3, { name: "Ada" });
  expect(room.awareness.getStates().get(5)).toEqual({ name: "Ada" });
  server.last.end(1006);
  expect(room.awareness.getStates().has(5)).toBe(false);
  vi.advanceTimersByTime(300);
  server.accept();
  server.presence(5, 3, { name: "Ada" });
  expect(room.awareness.getStates().get(5)).toEqual({ name: "Ada" });
});

test("the own presence is said again on return, with a newer clock, and nobody else's ever", () => {
  room.awareness.setLocalState({ selection: ["a"] });
  const first = server.accept();
  server.presence(5, 3, { name: "Ada" });
  first.end(1006);
  vi.advanceTimersByTime(300);
  const second = server.accept();
  const [before] = statesSent(first);
  const [after] = statesSent(second);
  expect(after?.state).toEqual({ selection: ["a"] });
  expect(after?.clock).toBeGreaterThan(before?.clock ?? Number.POSITIVE_INFINITY);
  expect(statesSent(first).length).toBe(1);
});

test("settled waits until everything is stored and tells the moment", async () => {
  server.accept();
  server.stalled = true;
  write("a");
  const settled = room.settled();
  server.commit();
  expect(await settled).toBe(1);
  expect(await room.settled()).toBe(1);
});

test("settled waits for the name of the moment when something has just arrived", async () => {
  server.accept();
  const told = vi.spyOn(server, "ack").mockImplementation(() => undefined);
  server.broadcast((doc) => write("theirs", doc));
  let moment = -1;
  void room.settled().then((seq) => {
    moment = seq;
  });
  await vi.advanceTimersByTimeAsync(0);
  expect(moment).toBe(-1);
  told.mockRestore();
  server.ack(server.last);
  await vi.advanceTimersByTimeAsync(0);
  expect(moment).toBe(1);
});

test("settled fails when the room is left or nobody waits any more", async () => {
  const controller = new AbortController();
  const aborted = room.settled(controller.signal);
  controller.abort();
  await expect(aborted).rejects.toThrow("aborted");
  const left = room.settled();
  room.close();
  await expect(left).rejects.toThrow("left");
});

test("the link is the same object until it changes, and listeners hear each change", () => {
  let heard = 0;
  const leave = room.onLink(() => {
    heard += 1;
  });
  const before = room.link();
  expect(room.link()).toBe(before);
  server.accept();
  expect(heard).toBe(1);
  leave();
  server.last.end(1006);
  expect(heard).toBe(1);
});

test("leaving says goodbye, closes the socket and comes back no more", () => {
  const socket = server.accept();
  room.close();
  expect(statesSent(socket).at(-1)?.state).toBeNull();
  expect(socket.readyState).toBe(3);
  write("after");
  vi.advanceTimersByTime(60_000);
  expect(server.sockets.length).toBe(1);
});

test("the address of a room follows the page's own", () => {
  expect(roomUrl("a/b", "https://host:1/graphs/x?y#z")).toBe("wss://host:1/api/graphs/a%2Fb/room");
  expect(roomUrl("g", "http://host/")).toBe("ws://host/api/graphs/g/room");
});

test("a server that is away for a known reason says it, is asked again, and the words go when it is back", async () => {
  room.close(); // its attempts are not meant
  let away: Away | null = new Away("not-stored", "The disk is full.");
  const asked: boolean[] = [];
  const admit = async (_again: boolean, hasWork: boolean) => {
    asked.push(hasWork);
    if (away !== null) throw away;
    return null;
  };
  const other = connectRoom({ url: "ws://h/room", open: server.open, random: () => 1, admit });
  await vi.advanceTimersByTimeAsync(0);
  expect(other.link()).toMatchObject({
    state: "offline",
    why: "not-stored",
    said: "The disk is full.",
  });
  other.doc.getMap("m").set("k", 1);
  away = new Away("proxy", "The proxy answers 502.");
  await vi.advanceTimersByTimeAsync(20_000);
  expect(other.link()).toMatchObject({ why: "proxy", said: "The proxy answers 502." });
  expect([asked[0], asked.at(-1)]).toEqual([false, true]);
  away = null;
  const before = server.sockets.length;
  while (server.sockets.length === before) await vi.advanceTimersByTimeAsync(500);
  server.accept();
  expect(other.link()).toEqual({ state: "live", unsaved: 0, seq: 1 });
  other.close();
});

test("a server that lets in but opens no socket is told from one that does not answer", async () => {
  let answers = true;
  const admit = async () => {
    if (!answers) throw new Error("nobody answers");
    return null;
  };
  const other = connectRoom({ url: "ws://h/room", open: server.open, random: () => 1, admit });
  const settle = () => vi.advanceTimersByTimeAsync(20_000);
  await vi.advanceTimersByTimeAsync(0);
  server.last.end(1006);
  expect(other.link()).toMatchObject({ state: "offline" });
  expect(other.link().why).toBeUndefined(); // once may be a restart
  await vi.advanceTimersByTimeAsync(300);
  server.last.end(1006);
  expect(other.link()).toMatchObject({ state: "offline", why: "no-socket" });
  answers = false;
  await settle();
  expect(other.link().why).toBeUndefined();
  answers = true;
  await settle();
  server.accept();
  expect(other.link().why).toBeUndefined();
  server.last.end(1006);
  expect(other.link().why).toBeUndefined();
  other.close();
});
