/**
 * The page's own code in Node, one JSON request per line and one answer per line: what the tests of
 * the wire talk to. Usage: node page.mjs FRONTEND_FOLDER
 */

import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import { pathToFileURL } from "node:url";

const frontend = resolve(process.argv[2]);
const require = createRequire(join(frontend, "package.json"));
const load = (name) => import(pathToFileURL(require.resolve(name)).href);

const page = await bundled();
const { Y } = page;
// Node's own knows no headers.
const { default: WebSocket } = await load("ws");

/** The modules under test and one Yjs for all of them, as one file. */
async function bundled() {
  const { rolldown } = await load("rolldown");
  const folder = mkdtempSync(join(tmpdir(), "page-"));
  try {
    const entry = join(frontend, "wire-test-entry.js");
    const source = `
      export * as edit from "./src/graph/edit/index.ts";
      export * as layout from "./src/graph/document-keys.ts";
      export * as read from "./src/graph/read.ts";
      export * as room from "./src/sync/room-connection.ts";
      export * as Y from "yjs";
      export { WebsocketProvider } from "y-websocket";
    `;
    const build = await rolldown({
      input: entry,
      platform: "node",
      logLevel: "silent",
      plugins: [
        {
          name: "entry",
          resolveId: (id) => (id === entry ? id : null),
          load: (id) => (id === entry ? source : null),
        },
      ],
    });
    const { output } = await build.generate({ format: "esm", codeSplitting: false });
    const file = join(folder, "page.mjs");
    writeFileSync(file, output[0].code);
    return await import(pathToFileURL(file).href);
  } finally {
    rmSync(folder, { recursive: true });
  }
}

const bytes = (hex) => Uint8Array.from(Buffer.from(hex, "hex"));
const hex = (data) => Buffer.from(data).toString("hex");

function docOf(update) {
  const doc = new Y.Doc();
  if (update) Y.applyUpdate(doc, bytes(update));
  return doc;
}

const answerOf = (doc) => ({
  update: hex(Y.encodeStateAsUpdate(doc)),
  graph: page.read.readGraph(page.layout.mapsOf(doc)),
});

/** Rooms that are open, by the name that the test gave them. */
const rooms = new Map();

function socketWith(token) {
  return class extends WebSocket {
    constructor(url, protocols) {
      super(url, protocols, { headers: { authorization: `Bearer ${token}` } });
    }
  };
}

const operations = {
  /** What the page sees in these bytes. */
  read: ({ update }) => answerOf(docOf(update)),

  /** A document with these plain maps, written by Yjs. */
  write({ maps }) {
    const doc = new Y.Doc();
    doc.transact(() => {
      for (const [root, fields] of Object.entries(maps)) {
        for (const [key, value] of Object.entries(fields)) doc.getMap(root).set(key, value);
      }
    });
    return answerOf(doc);
  },

  /** Edits by name; "$n" stands for what the n-th of them answered. */
  edit({ update, edits }) {
    const doc = docOf(update);
    const answers = [];
    for (const [name, ...given] of edits) {
      const values = given.map((value) =>
        typeof value === "string" && /^\$\d+$/.test(value) ? answers[value.slice(1)] : value,
      );
      answers.push(page.edit[name](doc, ...values));
    }
    return { ...answerOf(doc), answers };
  },

  /** Joins a room as the page does. */
  join({ name, url, token }) {
    const Socket = socketWith(token);
    const room = page.room.connectRoom({ url, open: (address) => new Socket(address) });
    rooms.set(name, { doc: room.doc, room, leave: () => room.close() });
    return {};
  },

  /** Joins a room with a stock y-websocket client. */
  joinStock({ name, base, token }) {
    const doc = new Y.Doc();
    const drops = { count: 0 };
    const provider = new page.WebsocketProvider(base, "room", doc, {
      WebSocketPolyfill: socketWith(token),
      disableBc: true,
    });
    provider.on("status", ({ status }) => {
      if (status === "disconnected") drops.count += 1;
    });
    rooms.set(name, { doc, provider, drops, leave: () => provider.destroy() });
    return {};
  },

  /** Says something about oneself. */
  say({ name, state }) {
    const { room, provider } = rooms.get(name);
    (room ?? provider).awareness.setLocalState(state);
    return {};
  },

  /** One edit in an open room. */
  act({ name, edit: [edit, ...values] }) {
    return { answer: page.edit[edit](rooms.get(name).doc, ...values) ?? null };
  },

  /** Makes the page show another name than it has, as no message would: its memory is at fault. */
  twist({ name, text }) {
    rooms.get(name).doc.getMap("meta")._map.get("name").content.arr[0] = text;
    return {};
  },

  /** How an open room stands. */
  look({ name }) {
    const { doc, room, provider, drops } = rooms.get(name);
    const awareness = (room ?? provider).awareness;
    return {
      graph: page.read.readGraph(page.layout.mapsOf(doc)),
      link: room ? room.link() : { state: provider.synced ? "live" : "connecting" },
      drops: drops?.count ?? 0,
      client: doc.clientID,
      states: Object.fromEntries(awareness.getStates()),
    };
  },

  leave({ name }) {
    rooms.get(name).leave();
    rooms.delete(name);
    return {};
  },
};

for await (const line of createInterface({ input: process.stdin })) {
  let answer;
  try {
    const { op, ...request } = JSON.parse(line);
    answer = operations[op](request);
  } catch (error) {
    answer = { error: `${error.stack}` };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
for (const { leave } of rooms.values()) leave();
process.exit(0);
