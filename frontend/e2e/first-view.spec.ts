/** What a browser that has nothing yet asks for until the first view is there: counted, not timed. */

import { type Browser, expect, type Page, test } from "@playwright/test";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

interface FirstView {
  /** Addresses, in their order. */
  readonly asked: readonly string[];
  /** Over the wire, with headers. */
  readonly kilobytes: number;
  /** Cumulative layout shift. */
  readonly shift: number;
}

declare global {
  var shifted: number;
}

function noteShifts(): void {
  globalThis.shifted = 0;
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
      globalThis.shifted += (entry as PerformanceEntry & { value: number }).value;
    }
  }).observe({ type: "layout-shift", buffered: true });
}

/** Opens an address in a browser with an empty cache, as somebody who is signed in. */
async function firstView(
  browser: Browser,
  path: string,
  isThere: (page: Page) => Promise<unknown>,
): Promise<FirstView> {
  const { context } = await product.person(browser, "Ada", { loadsAhead: false, panels: "folded" });
  const storageState = await context.storageState();
  await context.close();
  const cold = await browser.newContext({ storageState });
  await cold.addInitScript(() =>
    Object.defineProperty(navigator, "connection", { value: { saveData: true } }),
  );
  await cold.addInitScript(noteShifts);
  const page = await cold.newPage();
  const asked = new Map<string, string>();
  let bytes = 0;
  const network = await cold.newCDPSession(page);
  await network.send("Network.enable");
  network.on("Network.requestWillBeSent", ({ requestId, request: { url } }) => {
    if (url.startsWith("http")) asked.set(requestId, url);
  });
  network.on("Network.loadingFinished", ({ requestId, encodedDataLength }) => {
    if (asked.has(requestId)) bytes += encodedDataLength;
  });
  await page.goto(product.url + path);
  await isThere(page);
  await page.waitForLoadState("networkidle");
  const shift = await page.evaluate(() => globalThis.shifted);
  await cold.close();
  return { asked: [...asked.values()], kilobytes: bytes / 1000, shift };
}

const EDITOR = { requests: 45, kilobytes: 680, shift: 0.15 } as const;

const repeated = (asked: readonly string[]) => asked.filter((url, i) => asked.indexOf(url) < i);

test("the first page asks for little, and for nothing twice", async ({ browser }) => {
  const view = await firstView(browser, "/", (page) =>
    expect(page.locator("article svg[viewBox] rect").first()).toBeVisible(),
  );
  const { asked } = view;
  expect(asked.length, asked.join("\n")).toBeLessThanOrEqual(20);
  expect(view.kilobytes).toBeLessThanOrEqual(300);
  expect(view.shift).toBeLessThan(0.02);
  expect(repeated(asked)).toEqual([]);
  const thumbnails = asked.filter((url) => url.includes("/thumbnails?"));
  expect(thumbnails).toHaveLength(1);
  expect(asked.filter((url) => url.includes("/umrf"))).toEqual([]);
});

// Goal: 20 requests and 350 kB. The rest is code that is needed soon after.
test("an editor asks for no more than it did", async ({ browser }) => {
  const [graph] = await product.ask<{ id: string }[]>("/api/graphs");
  const view = await firstView(browser, `/graphs/${graph?.id}`, (page) =>
    expect(page.locator(".react-flow__node-action").first()).toBeVisible(),
  );
  const { asked } = view;
  expect(asked.length, asked.join("\n")).toBeLessThanOrEqual(EDITOR.requests);
  expect(view.kilobytes).toBeLessThanOrEqual(EDITOR.kilobytes);
  expect(view.shift).toBeLessThan(EDITOR.shift);
});
