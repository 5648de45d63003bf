/** The page, a stock y-websocket client and pycrdt's own client share a room and stay in it. */

import { spawn } from "node:child_process";
import { resolve } from "node:path";
import { createInterface } from "node:readline";
import { expect, test } from "@playwright/test";
import WebSocket from "ws";
import { WebsocketProvider } from "y-websocket";
import * as Y from "yjs";
import { add, card, saved } from "./canvas";
import { Product, pause, TOKEN } from "./product";

const PYTHON = resolve(import.meta.dirname, "../../.venv/bin/python");
const IDLE = Number(process.env.TEST_IDLE_SECONDS ?? "2") * 1000;
const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** A WebSocket of Node's that knows the token; browsers send their cookie. */
class WithToken extends WebSocket {
  constructor(url: string, protocols?: string[]) {
    super(url, protocols, { headers: { authorization: `Bearer ${TOKEN}` } });
  }
}

const named = (names: string) => [...names.split(" ")].sort().join(" ");

test("three kinds of clients converge, and nobody is dropped while nothing happens", async ({
  browser,
}) => {
  test.setTimeout(120_000 + IDLE);
  const { page, failures } = await product.person(browser, "Ada");
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  const room = `${page.url().replace("/graphs/", "/api/graphs/")}/room`;

  const doc = new Y.Doc();
  const stock = new WebsocketProvider(
    room.replace("http", "ws").replace(/\/room$/, ""),
    "room",
    doc,
    { WebSocketPolyfill: WithToken as unknown as typeof globalThis.WebSocket, disableBc: true },
  );
  const drops: string[] = [];
  stock.on("connection-close", (event) => {
    drops.push(`${event?.code} ${event?.reason}`);
  });
  const python = spawn(PYTHON, [
    resolve(import.meta.dirname, "pycrdt_client.py"),
    room,
    TOKEN,
    "Snake",
  ]);
  let told = "";
  // By line: without buffering, Python writes a line and its end one after the other.
  createInterface(python.stdout).on("line", (line) => {
    told = line;
  });
  let complaints = "";
  python.stderr.on("data", (chunk: Buffer) => {
    complaints += chunk.toString();
  });

  const inStock = () =>
    named(
      [...doc.getMap<string>("actions").entries()]
        .filter(([key]) => !key.includes("|"))
        .map(([, name]) => name)
        .join(" "),
    );
  await expect.poll(() => told, { message: complaints }).toBe("Snake");
  await add(page, "Leaf");
  doc.getMap("actions").set("Stock0000000", "Stock");

  const everybody = async (names: string[]) => {
    const all = named(names.join(" "));
    await expect.poll(inStock).toBe(all);
    await expect.poll(() => told).toBe(all);
    for (const name of names) await expect(card(page, name)).toBeVisible();
    await saved(page);
  };
  await everybody(["Leaf", "Snake", "Stock"]);

  await pause(IDLE);
  doc.getMap("actions").set("Stock0000001", "Later");
  await everybody(["Later", "Leaf", "Snake", "Stock"]);
  expect(drops).toEqual([]);

  python.stdin.end();
  const code = await new Promise((done) => python.once("exit", done));
  expect(complaints).toBe("");
  expect(code).toBe(0);
  stock.destroy();
  expect(failures).toEqual([]);
});
