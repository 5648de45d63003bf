/** What the page keeps in a browser's own storage, on an address that offers no secure context. */

import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { rolldown } from "rolldown";
import type * as module from "../src/sync/indexed-db";

type Module = typeof module;
type Batch = Parameters<module.EditStore["write"]>[2];

const ADDRESS = "http://tablet.test/";
const ADA = { graph: "g", person: { id: "a", name: "Ada" } };
const MARI = { graph: "g", person: { id: "m", name: "Mari" } };

let code: string;

test.beforeAll(async () => {
  const input = resolve(import.meta.dirname, "../src/sync/indexed-db.ts");
  const build = await rolldown({ input, logLevel: "silent" });
  const { output } = await build.generate({ format: "iife", name: "device" });
  code = output[0].code;
});

test.beforeEach(async ({ page }) => {
  await page.route(ADDRESS, (route) => route.fulfill({ contentType: "text/html", body: "<p>" }));
  await visit(page);
});

/** A new page over the same storage. */
async function visit(page: Page): Promise<void> {
  await page.goto(ADDRESS);
  await page.evaluate(`${code}; window.tested = device; window.device = device.indexedDbStore()`);
}

const NOTHING: Batch = { waits: [], known: [], durable: [], copy: null, seq: 1 };
const edit = (id: string) => ({ id, update: Uint8Array.of(1, 2, 3), at: 5 });

type Call = {
  [M in keyof module.EditStore]: [M, ...Parameters<module.EditStore[M]>];
}[keyof module.EditStore];

/** One call in the page. Bytes travel as arrays of numbers. */
function call(page: Page, ...given: Call): Promise<unknown> {
  const text = JSON.stringify(given, (_, value) =>
    value instanceof Uint8Array ? { bytes: [...value] } : value,
  );
  return page.evaluate(async (sent) => {
    const [method, ...values] = JSON.parse(sent, (_, value) =>
      value?.bytes ? Uint8Array.from(value.bytes) : value,
    );
    const device = Reflect.get(window, "device") as Record<string, (...v: unknown[]) => unknown>;
    const answer = await device[method]?.(...values);
    return JSON.parse(
      JSON.stringify(answer ?? null, (_, value) =>
        value instanceof Uint8Array ? [...value] : value,
      ),
    ) as unknown;
  }, text);
}

test("this address is no secure context, and the device keeps all the same", async ({ page }) => {
  expect(await page.evaluate(() => window.isSecureContext)).toBe(false);
  expect(await call(page, "read", ADA)).toEqual([]);
  const batch = { ...NOTHING, waits: [edit("1"), edit("2")], known: [Uint8Array.of(9)], seq: 4 };
  await call(page, "write", ADA, "0", batch);
  await visit(page);
  const waiting = [edit("1"), edit("2")].map((each) => ({ ...each, update: [1, 2, 3] }));
  const kept = { epoch: "0", seq: 4, known: [[9]], waiting };
  expect(await call(page, "read", ADA)).toEqual([kept]);
});

test("what became durable waits no more and is part of what is known", async ({ page }) => {
  await call(page, "write", ADA, "0", { ...NOTHING, waits: [edit("1"), edit("2")] });
  await call(page, "write", ADA, "0", { ...NOTHING, durable: [edit("1")], seq: 2 });
  expect(await call(page, "read", ADA)).toMatchObject([
    { seq: 2, known: [[1, 2, 3]], waiting: [{ id: "2" }] },
  ]);
  const copy = Uint8Array.of(7);
  await call(page, "write", ADA, "0", { ...NOTHING, durable: [edit("2")], copy, seq: 3 });
  expect(await call(page, "read", ADA)).toEqual([
    { epoch: "0", seq: 3, known: [[7]], waiting: [] },
  ]);
});

test("persons, graphs and epochs are apart", async ({ page }) => {
  await call(page, "write", ADA, "0", { ...NOTHING, waits: [edit("1"), edit("2")] });
  await call(page, "write", ADA, "1", { ...NOTHING, waits: [edit("3")] });
  expect(await call(page, "read", MARI)).toEqual([]);
  expect(await call(page, "read", { ...ADA, graph: "h" })).toEqual([]);
  expect(await call(page, "others", ADA)).toEqual([]);
  expect(await call(page, "others", MARI)).toEqual([{ id: "a", name: "Ada", waiting: 3 }]);
  await call(page, "forget", ADA, "0", ["1"]);
  expect(await call(page, "read", ADA)).toMatchObject([
    { epoch: "0", waiting: [{ id: "2" }] },
    { epoch: "1" },
  ]);
  await call(page, "forget", ADA, "0", ["2"]);
  expect(await call(page, "read", ADA)).toMatchObject([{ epoch: "1", waiting: [{ id: "3" }] }]);
});

test("choices wait beside the edits, each tab changes only its own, and no copy with one is let go", async ({
  page,
}) => {
  const choice = (id: string) => ({
    ...{ id, root: "meta" as const, key: id, mine: "a", theirs: null, since: 1 },
    cause: "return" as const,
    writes: { mine: [], theirs: null },
  });
  const put = (...ids: string[]) => ({ choices: { put: ids.map(choice), gone: [] } });
  await call(page, "write", ADA, "0", { ...NOTHING, ...put("x", "y"), client: 7 });
  await call(page, "write", ADA, "0", { ...NOTHING, ...put("z"), client: 8 }); // another tab
  await call(page, "write", ADA, "0", { ...NOTHING, choices: { put: [], gone: ["x"] }, client: 7 });
  await call(page, "write", ADA, "0", NOTHING);
  await call(page, "leave", "a");
  await visit(page);
  const kept = { choices: [choice("y"), choice("z")], clients: [7, 8] };
  expect(await call(page, "read", ADA)).toMatchObject([kept]);
  await call(page, "write", ADA, "0", { ...NOTHING, choices: { put: [], gone: ["y", "z"] } });
  await call(page, "leave", "a");
  expect(await call(page, "read", ADA)).toEqual([]);
});

/** Waits until the clock of the page has gone on, so that what is written next is newer. */
async function nextTick(page: Page): Promise<void> {
  const now = await page.evaluate(() => Date.now());
  await page.waitForFunction((before) => Date.now() > before + 1, now);
}

test("of several epochs the one that was used last stands at the end", async ({ page }) => {
  await call(page, "write", ADA, "old", { ...NOTHING, waits: [edit("1")] });
  await nextTick(page);
  await call(page, "write", ADA, "new", NOTHING);
  expect(await call(page, "read", ADA)).toMatchObject([{ epoch: "old" }, { epoch: "new" }]);
  await nextTick(page);
  await call(page, "write", ADA, "old", { ...NOTHING, durable: [edit("1")] });
  expect(await call(page, "read", ADA)).toMatchObject([{ epoch: "new" }, { epoch: "old" }]);
});

test("the copies are bounded, and edits that wait are never what goes", async ({ page }) => {
  const most = await page.evaluate(() => (Reflect.get(window, "tested") as Module).MOST_COPIES);
  await call(page, "write", { ...ADA, graph: "waits" }, "0", { ...NOTHING, waits: [edit("1")] });
  for (let n = 0; n < most + 5; n += 1) {
    const copy = Uint8Array.of(n);
    await call(page, "write", { ...ADA, graph: `g${n}` }, "0", { ...NOTHING, copy });
  }
  expect(await call(page, "read", { ...ADA, graph: "g0" })).toEqual([]);
  expect(await call(page, "read", { ...ADA, graph: `g${most + 4}` })).toHaveLength(1);
  expect(await call(page, "read", { ...ADA, graph: "waits" })).toMatchObject([
    { waiting: [{ id: "1" }] },
  ]);
});

test("a browser without storage refuses each call and throws nothing else", async ({ page }) => {
  const said = await page.evaluate(async (shelf) => {
    const { indexedDbStore: deviceOf } = Reflect.get(window, "tested") as Module;
    const refusing = { open: () => indexedDB.open("x", 0 as never) } as unknown as IDBFactory;
    const reading = deviceOf(refusing).read(shelf);
    return reading.then(
      () => "kept",
      () => "refused",
    );
  }, ADA);
  expect(said).toBe("refused");
});
