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
  /** What was asked for before the first card of an editor was drawn. */
  readonly beforeCard: Pick<FirstView, "asked" | "kilobytes">;
}

declare global {
  var shifted: number;
  /** When the first card of an editor was drawn, by the clock of the page, ms; infinite before. */
  var firstCard: number;
}

function noteShifts(): void {
  globalThis.shifted = 0;
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries()) {
      globalThis.shifted += (entry as PerformanceEntry & { value: number }).value;
    }
  }).observe({ type: "layout-shift", buffered: true });
}

function noteFirstCard(): void {
  globalThis.firstCard = Number.POSITIVE_INFINITY;
  const look = (now: number) => {
    const card = document.querySelector(".react-flow__node-action");
    if (card?.checkVisibility({ visibilityProperty: true, opacityProperty: true }))
      globalThis.firstCard = now;
    else requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
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
  await cold.addInitScript(noteFirstCard);
  const page = await cold.newPage();
  const asked = new Map<string, { readonly url: string; readonly at: number }>();
  const bytes = new Map<string, number>();
  const network = await cold.newCDPSession(page);
  await network.send("Network.enable");
  network.on("Network.requestWillBeSent", ({ requestId, request: { url }, wallTime }) => {
    if (url.startsWith("http")) asked.set(requestId, { url, at: wallTime * 1000 });
  });
  network.on("Network.loadingFinished", ({ requestId, encodedDataLength }) => {
    const url = asked.get(requestId)?.url;
    if (url !== undefined) bytes.set(url, (bytes.get(url) ?? 0) + encodedDataLength);
  });
  await page.goto(product.url + path);
  await isThere(page);
  await page.waitForLoadState("networkidle");
  const shift = await page.evaluate(() => globalThis.shifted);
  // By the clock of the browser: what is asked for later may be on its way for long.
  const drawn = await page.evaluate(() => performance.timeOrigin + globalThis.firstCard);
  await cold.close();
  const kilobytes = (urls: readonly string[]) =>
    [...new Set(urls)].reduce((sum, url) => sum + (bytes.get(url) ?? 0), 0) / 1000;
  const all = [...asked.values()].map(({ url }) => url);
  const before = [...asked.values()].flatMap(({ url, at }) => (at <= drawn ? [url] : []));
  return {
    asked: all,
    kilobytes: kilobytes(all),
    shift,
    beforeCard: { asked: before, kilobytes: kilobytes(before) },
  };
}

const repeated = (asked: readonly string[]) => asked.filter((url, i) => asked.indexOf(url) < i);

test("the first page asks for little, and for nothing twice", async ({ browser }) => {
  const view = await firstView(browser, "/", (page) =>
    expect(page.locator("article svg[viewBox] rect").first()).toBeVisible(),
  );
  const { asked } = view;
  expect(asked.length, asked.join("\n")).toBeLessThanOrEqual(20);
  expect(view.kilobytes).toBeLessThanOrEqual(240);
  expect(view.shift).toBeLessThan(0.02);
  expect(repeated(asked)).toEqual([]);
  const thumbnails = asked.filter((url) => url.includes("/thumbnails?"));
  expect(thumbnails).toHaveLength(1);
  expect(asked.filter((url) => url.includes("/umrf"))).toEqual([]);
});

test("an editor draws its first card before it asks for anything else", async ({ browser }) => {
  const [graph] = await product.ask<{ id: string }[]>("/api/graphs");
  const view = await firstView(browser, `/graphs/${graph?.id}`, (page) =>
    expect(page.locator(".react-flow__node-action").first()).toBeVisible(),
  );
  const { asked, kilobytes } = view.beforeCard;
  expect(asked.length, asked.join("\n")).toBeLessThanOrEqual(20);
  expect(kilobytes, asked.join("\n")).toBeLessThanOrEqual(351);
  expect(view.asked.length, view.asked.join("\n")).toBeLessThanOrEqual(40);
  expect(view.kilobytes).toBeLessThanOrEqual(530);
  expect(view.shift).toBeLessThan(0.02);
});
