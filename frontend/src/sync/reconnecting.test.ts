/** Tests of the times at which a room that lost its connection tries again. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type * as Y from "yjs";
import { FakeServer, type FakeSocket } from "../testing/fake-server";
import { connectRoom, type Room } from "./room-connection";

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

test("attempts become rarer, up to one in ten seconds, and never two at once", () => {
  const gaps: number[] = [];
  for (let attempt = 0; attempt < 9; attempt += 1) {
    const before = server.sockets.length;
    server.last.end(1006);
    let waited = 0;
    while (server.sockets.length === before) {
      vi.advanceTimersByTime(100);
      waited += 100;
    }
    expect(server.sockets.length).toBe(before + 1);
    gaps.push(waited);
  }
  expect(gaps).toEqual([300, 600, 1200, 2400, 4800, 9600, 10_000, 10_000, 10_000]);
});

/** The page's own window and document, as far as a room listens to them. */
function stage() {
  const listeners = new Map<string, () => void>();
  const listen = (kind: string, listener: () => void) => void listeners.set(kind, listener);
  const document = { visibilityState: "visible", addEventListener: listen };
  vi.stubGlobal("addEventListener", listen);
  vi.stubGlobal("document", { ...document, removeEventListener: vi.fn() });
  vi.stubGlobal("removeEventListener", vi.fn());
  const other = connectRoom({ url: "ws://host/room", open: server.open, random: () => 1 });
  return {
    other,
    happens: (kind: string) => listeners.get(kind)?.(),
    see: (visibilityState: "visible" | "hidden") =>
      Object.assign(globalThis.document, { visibilityState }),
    end() {
      other.close();
      vi.unstubAllGlobals();
    },
  };
}

test.each(["online", "visibilitychange"])("%s is reason to try at once", (kind) => {
  const page = stage();
  server.last.end(1006);
  const before = server.sockets.length;
  page.happens(kind);
  expect(server.sockets.length).toBe(before + 1);
  page.end();
});

test("a hidden page that has nothing to save comes back slowly; with edits it hurries", () => {
  const page = stage();
  server.accept();
  page.see("hidden");
  page.happens("visibilitychange");
  server.last.end(1006);
  const before = server.sockets.length;
  vi.advanceTimersByTime(59_000);
  expect(server.sockets.length).toBe(before);
  vi.advanceTimersByTime(1_000);
  expect(server.sockets.length).toBe(before + 1);
  write("a", page.other.doc);
  server.last.end(1006);
  vi.advanceTimersByTime(10_000);
  expect(server.sockets.length).toBe(before + 2);
  page.end();
});

test.each(["online", "offline", "visibilitychange"])(
  "on %s a socket that looks open is asked whether it lives, and given up when it is mute",
  (kind) => {
    const page = stage();
    const socket = server.accept();
    page.happens(kind);
    vi.advanceTimersByTime(7_000);
    expect(page.other.link().state).toBe("live"); // it answered
    const deaf = vi.spyOn(socket, "send").mockImplementation(() => undefined);
    page.happens(kind);
    vi.advanceTimersByTime(7_000);
    expect(deaf).toHaveBeenCalledOnce();
    expect(socket.readyState).toBe(3);
    expect(page.other.link().state).toBe("offline");
    page.end();
  },
);

/** Holds all that goes over a socket, as a network that is away does; the answer lets it through. */
function holdBack(socket: FakeSocket) {
  const [out, back]: [Uint8Array[], Uint8Array[]] = [[], []];
  const [send, deliver] = [socket.send.bind(socket), socket.deliver.bind(socket)];
  socket.send = (data) => void out.push(data);
  socket.deliver = (data) => void back.push(data);
  return {
    /** The server gets what was said, even by a page that has left this socket. */
    arrives: () => {
      for (const data of out.splice(0)) server.take(socket, data);
    },
    comesBack: () => {
      Object.assign(socket, { send, deliver });
      for (const data of back.splice(0)) deliver(data);
    },
  };
}

const saying = (value: string, doc: Y.Doc) => doc.getMap("meta").set("description", value);

test.each(["online", "offline", "visibilitychange"])(
  "on %s an edit waits for the answer, so that a value of others is taken before it is overwritten",
  (kind) => {
    const page = stage();
    const { doc, changedTwice, link } = page.other;
    [doc.clientID, server.doc.clientID] = [2_000, 1_000]; // what is set here wins
    const network = holdBack(server.accept());
    page.happens(kind);
    saying("mine", doc);
    expect(link()).toMatchObject({ state: "live", unsaved: 1 });
    server.broadcast((theirs) => saying("theirs", theirs));
    vi.advanceTimersByTime(7_000);
    expect(link().state).toBe("offline");
    network.arrives(); // the old socket is heard before the new one
    expect(server.doc.getMap("meta").get("description")).toBe("theirs");
    vi.advanceTimersByTime(300);
    server.accept();
    expect(link()).toMatchObject({ state: "live", unsaved: 0 });
    expect(server.doc.getMap("meta").get("description")).toBe("mine");
    expect(changedTwice.now()).toMatchObject([{ mine: "mine", theirs: "theirs" }]);
    page.end();
  },
);

test("edits made while a socket is in doubt are sent after it has answered, and not before", () => {
  const page = stage();
  const { doc, changedTwice, link } = page.other;
  [doc.clientID, server.doc.clientID] = [2_000, 1_000];
  const socket = server.accept();
  const network = holdBack(socket);
  page.happens("offline");
  saying("mine", doc);
  write("too", doc);
  server.broadcast((theirs) => saying("theirs", theirs));
  vi.advanceTimersByTime(4_000);
  page.happens("online");
  network.arrives();
  expect(server.doc.getMap("meta").toJSON()).toEqual({ description: "theirs" });
  network.comesBack();
  expect(server.last).toBe(socket);
  expect(link()).toMatchObject({ state: "live", unsaved: 0 });
  expect(server.doc.getMap("meta").toJSON()).toEqual({ description: "mine", too: 1 });
  expect(changedTwice.now()).toMatchObject([{ mine: "mine", theirs: "theirs" }]);
  page.end();
});

test("reconnects are spread over half of the time, so that a thousand do not come at once", () => {
  for (const [random, expected] of [
    [0, 150],
    [0.5, 225],
    [1, 300],
  ] as const) {
    const own = new FakeServer();
    const other = connectRoom({ url: "ws://host/room", open: own.open, random: () => random });
    own.last.end(1006);
    vi.advanceTimersByTime(expected - 1);
    expect(own.sockets.length).toBe(1);
    vi.advanceTimersByTime(1);
    expect(own.sockets.length).toBe(2);
    other.close();
  }
});
