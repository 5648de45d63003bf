/** Work without a server: edits wait on the device, for one person, and are merged on return. */

import { readFileSync } from "node:fs";
import { expect, type Locator, type Page, test } from "@playwright/test";
import { add, card, saved, umrfOf } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeEach(() => product.start());
test.afterEach(() => product.kill());
test.afterAll(() => product.dispose());

interface Graph {
  id: string;
  seq: number;
}

async function newGraph(name: string): Promise<string> {
  const body = JSON.stringify({ name });
  const headers = { "content-type": "application/json" };
  return (await product.ask<Graph>("/api/graphs", { method: "POST", body, headers })).id;
}

/** The names of the actions as the log has them. */
async function stored(graph: string): Promise<string[]> {
  const file = await product.ask<{ actions: { name: string }[] }>(`/api/graphs/${graph}/umrf`);
  return file.actions.map(({ name }) => name).sort();
}

async function enter(page: Page, graph: string): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
}

async function offline(page: Page, changes: number): Promise<void> {
  const words = changes === 1 ? "1 change" : `${changes} changes`;
  await expect(
    page.getByText(new RegExp(`(offline|server away).*\\b${words}`, "i")).first(),
  ).toBeVisible();
}

/** The edits that wait on this device, by person, as the browser stores them. */
function waiting(page: Page): Promise<Record<string, number>> {
  return page.evaluate(async () => {
    const open = indexedDB.open("action-assistant");
    await new Promise((done, fail) => {
      open.onsuccess = done;
      open.onerror = fail;
    });
    const keys = open.result.transaction("waiting").objectStore("waiting").getAllKeys();
    await new Promise((done) => {
      keys.onsuccess = done;
    });
    open.result.close();
    const counts: Record<string, number> = {};
    for (const key of keys.result as unknown as [string, string][]) {
      counts[key[1]] = (counts[key[1]] ?? 0) + 1;
    }
    return counts;
  });
}

/** Return how many pixels of a text its row hides. */
function cutOff(text: Locator): Promise<number> {
  return text.evaluate((it) => {
    let hidden = 0;
    for (let row = it.parentElement; row !== null; row = row.parentElement) {
      const over = it.getBoundingClientRect().right - row.getBoundingClientRect().right;
      if (getComputedStyle(row).overflowX !== "visible") hidden = Math.max(hidden, over);
    }
    return Math.ceil(hidden);
  });
}

test("edits made while the server is gone survive closing the tab and are merged on return", async ({
  browser,
}) => {
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  const graph = await newGraph("survives");
  await enter(ada.page, graph);
  await add(ada.page, "Before");
  await saved(ada.page);
  await product.kill();
  await add(ada.page, "While");
  await offline(ada.page, 1);
  await expect.poll(() => waiting(ada.page).then(Object.values)).toEqual([1]);
  await ada.page.setViewportSize({ width: 320, height: 844 }); // where the words need two lines
  expect(await cutOff(ada.page.getByText(/Server away with/))).toBe(0);
  await ada.page.close();
  await product.start();
  await enter(mari.page, graph);
  await add(mari.page, "Meanwhile");
  await saved(mari.page);
  expect(await stored(graph)).toEqual(["Before", "Meanwhile"]);

  const again = await ada.context.newPage();
  await enter(again, graph);
  expect(await stored(graph)).toEqual(["Before", "Meanwhile", "While"]);
  for (const page of [again, mari.page]) {
    for (const name of ["Before", "Meanwhile", "While"]) {
      await expect(card(page, name)).toBeVisible();
    }
  }
  expect(await waiting(again)).toEqual({});
  await ada.context.close();
  await mari.context.close();
});

test("on a shared tablet nobody's edits are sent under another name", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  const graph = await newGraph("shared");
  await enter(ada.page, graph);
  await add(ada.page, "First");
  await saved(ada.page);
  const cookies = await ada.context.cookies();
  await product.kill();
  await add(ada.page, "OfAda");
  await offline(ada.page, 1);
  await expect.poll(() => waiting(ada.page).then(Object.values)).toEqual([1]);

  // Mari signs in with the same browser; the tab in which Ada worked is still open.
  await ada.context.clearCookies();
  await ada.context.addCookies(await mari.context.cookies());
  await product.start();
  await expect(ada.page.getByText(/somebody else signed in/i).first()).toBeVisible();
  const other = await ada.context.newPage();
  await enter(other, graph);
  await add(other, "OfMari");
  await saved(other);
  await expect(card(other, "OfAda")).toHaveCount(0);
  expect(await stored(graph)).toEqual(["First", "OfMari"]);
  expect(Object.values(await waiting(other))).toEqual([1]);
  // She is told whose it is, and may save it for Ada.
  await expect(other.getByText("1 change of Ada waits on this device")).toBeVisible();
  await other.getByRole("button", { name: "Look", exact: true }).click();
  const dialog = other.getByRole("dialog", { name: /^Unsaved changes that other people made/ });
  const downloading = other.waitForEvent("download");
  await dialog.getByRole("button", { name: "Save as a file" }).click();
  const file = JSON.parse(readFileSync(await (await downloading).path(), "utf8"));
  expect(file).toMatchObject({ made_by: "Ada", changes: [{ what: "added action OfAda" }] });
  await other.screenshot({ path: test.info().outputPath("others.png") });
  await other.close();
  await ada.page.close();

  await ada.context.clearCookies();
  await ada.context.addCookies(cookies);
  const again = await ada.context.newPage();
  await enter(again, graph);
  expect(await stored(graph)).toEqual(["First", "OfAda", "OfMari"]);
  const done = await product.ask<{ author: { name: string } }[]>(`/api/graphs/${graph}/history`);
  expect(done[0]?.author.name).toBe("Ada");
  await ada.context.close();
  await mari.context.close();
});

test("100 edits without a network and those of others meet: nothing is lost, and Saved means stored", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  test.setTimeout(180_000);
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  const graph = await newGraph("many");
  await enter(ada.page, graph);
  await add(ada.page, "Part");
  await saved(ada.page);
  await enter(mari.page, graph);
  await ada.context.setOffline(true);
  await card(ada.page, "Part").click({ position: { x: 50, y: 30 } });
  // Each card more makes the next edit slower to draw, so most of them move the last one.
  for (let n = 0; n < 20; n += 1) await ada.page.keyboard.press("Control+d");
  for (let n = 0; n < 80; n += 1) await ada.page.keyboard.press("ArrowRight");
  for (let n = 0; n < 5; n += 1) await add(mari.page, `Meanwhile${n}`);
  await saved(mari.page);
  await offline(ada.page, 100);
  await expect.poll(() => waiting(ada.page).then(Object.values)).toEqual([100]);
  expect((await stored(graph)).length).toBe(6);

  await ada.context.setOffline(false);
  await saved(ada.page);
  await product.kill();
  await product.start();
  const names = await stored(graph);
  expect(names.filter((name) => name === "Part")).toHaveLength(21);
  expect(names.filter((name) => name.startsWith("Meanwhile"))).toHaveLength(5);
  const { actions } = await umrfOf(product, graph);
  const across = actions
    .filter(({ name }) => name === "Part")
    .map((action) => action.gui_attributes?.position?.x ?? 0);
  expect(Math.max(...across) - Math.min(...across)).toBe(20 * 40 + 80 * 8);
  await saved(ada.page);
  expect(await waiting(ada.page)).toEqual({});
  const { seq } = await product.ask<Graph>(`/api/graphs/${graph}`);
  for (const { page } of [ada, mari]) {
    await saved(page);
    await expect(page.getByTitle(`Moment ${seq}`, { exact: true })).toBeVisible();
  }
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await ada.context.close();
  await mari.context.close();
});

test("the page opens without a server, with what the device keeps, and says what cannot be done", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada", { loadsAhead: true, serviceWorkers: "allow" });
  const graph = await newGraph("kept");
  await enter(ada.page, graph);
  await add(ada.page, "Kept");
  await saved(ada.page);
  await ada.page.evaluate(() => navigator.serviceWorker.ready);
  await expect.poll(() => ada.page.evaluate(() => caches.keys())).toHaveLength(1);
  await ada.page.close();
  await product.kill();

  const page = await ada.context.newPage();
  const asked: string[] = [];
  page.on("request", (request) => asked.push(`${request.method()} ${request.url()}`));
  await page.goto(`${product.url}/`);
  await expect(page.getByText(/robots cannot be started or stopped from here now/i)).toBeVisible();
  await page
    .getByRole("region", { name: "On this device" })
    .getByRole("link", { name: "kept" })
    .click();
  await expect(card(page, "Kept")).toBeVisible();
  await add(page, "Alone");
  await offline(page, 1);
  await expect(
    page.getByRole("button", { name: "Run v1: The runner does not answer" }),
  ).toBeDisabled();
  await page.getByRole("button", { name: /^Stop everything/ }).click();
  await expect(page.getByText(/NOT SENT|MAY REACH NOBODY/).first()).toBeVisible();
  await page.screenshot({ path: test.info().outputPath("offline.png") });
  expect(asked.filter((each) => /POST.*\/api\/runs/.test(each))).toEqual([]);
  const kept = await page.evaluate(async () => {
    const stores = await Promise.all((await caches.keys()).map((name) => caches.open(name)));
    const all = await Promise.all(stores.map((store) => store.keys()));
    return all.flat().map(({ url }) => new URL(url).pathname);
  });
  expect(kept.filter((path) => /^\/(api|runner|healthz|schema)/.test(path))).toEqual([]);

  await product.start();
  await saved(page);
  expect(await stored(graph)).toEqual(["Alone", "Kept"]);
  await expect(page.getByText(/robots cannot be started/i)).toBeHidden();
  await ada.context.close();
});
