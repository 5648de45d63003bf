/** What can be placed from beside a canvas: graphs below the actions, by keys and fingers; a thousand. */

import { expect, type Locator, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { action, leaf, using } from "./library-actions";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const pane = (page: Page) => page.getByRole("complementary", { name: "Library" });

const drawn = (graph: string) =>
  product.ask<{ actions: { name: string; input_parameters?: object }[] }>(
    `/api/graphs/${graph}/umrf`,
  );

test("another graph is found below the actions, and placed by keys as one edit", async ({
  browser,
}) => {
  await using(product, "fetch_pallet", action("DriveUp", { pallet: leaf("string") }));
  const round = await using(product, "night_round", action("Wait", {}));
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${round}`);
  await saved(page);
  await pane(page).getByText("Actions", { exact: true }).click();
  const graphs = pane(page).getByRole("region", { name: "Graphs as actions" });
  await expect(graphs.getByRole("button", { name: /^fetch_pallet/ })).toContainText("pallet");
  await expect(graphs.getByRole("button", { name: /^night_round/ })).toHaveCount(0);

  await page.getByRole("textbox", { name: "Search graphs and actions" }).fill("fetch_pal");
  await expect(graphs.getByRole("button")).toHaveCount(1);
  await page.keyboard.press("Tab");
  while (!(await graphs.getByRole("button").evaluate((it) => it === document.activeElement)))
    await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await expect(card(page, "fetch_pallet")).toBeVisible();
  await saved(page);
  const placed = (await drawn(round)).actions.find(({ name }) => name === "fetch_pallet");
  expect(placed?.input_parameters).toEqual({ pallet: leaf("string") });

  // What stands for a graph is listed as the graph, once.
  await expect(pane(page).getByRole("button", { name: /^fetch_pallet/ })).toHaveCount(1);
  await page.getByRole("button", { name: "Undo" }).click();
  await expect(card(page, "fetch_pallet")).toHaveCount(0);
  await saved(page);
  expect((await drawn(round)).actions.map(({ name }) => name)).toEqual(["Wait"]);
  expect(failures).toEqual([]);
  await context.close();
});

test("a finger places a graph, and a phone has it in the search", async ({ browser }) => {
  await using(product, "clean_hall", action("Sweep", {}));
  await using(product, "wash_hall", action("Sweep", {}));
  const day = await using(product, "day_round", action("Wait", {}));
  const tablet = { viewport: { width: 1180, height: 820 }, hasTouch: true };
  const { page, context, failures } = await product.person(browser, "Ada", tablet);
  await page.goto(`${product.url}/graphs/${day}`);
  await saved(page);
  const tab = pane(page).getByText("Actions", { exact: true });
  if (!(await tab.isVisible()))
    await page.getByRole("button", { name: "Graphs and actions" }).tap();
  await tab.tap();
  const row = pane(page).getByRole("button", { name: /^clean_hall/ });
  expect((await row.boundingBox())?.height).toBeGreaterThanOrEqual(44);
  await row.tap();
  await expect(card(page, "clean_hall")).toBeVisible();
  await saved(page);
  expect(failures).toEqual([]);
  await context.close();

  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
  const small = await product.person(browser, "Ben", phone);
  await small.page.goto(`${product.url}/graphs/${day}`);
  await saved(small.page);
  await small.page.getByRole("radiogroup").getByText("Outline", { exact: true }).tap();
  await small.page.getByRole("button", { name: "Add an action" }).tap();
  await small.page.getByRole("combobox", { name: "Name of an action" }).fill("wash_h");
  await small.page.getByRole("option", { name: /^wash_hall/ }).tap();
  await expect(small.page.getByRole("row", { name: "wash_hall", exact: true })).toBeVisible();
  await saved(small.page);
  expect(small.failures).toEqual([]);
  await small.context.close();
});

test("of a thousand actions only those near what is in sight are laid out", async ({ browser }) => {
  const graph = await using(product, "long_list", action("Wait", {}));
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.route("**/api/actions", async (route) => {
    const one = { description: "", type: "sync", inputs: [], outputs: [], labels: [] };
    const known = { used_in: [], differs_in: [], first_seen: "2026-01-01T00:00:00Z", seq: 1 };
    const json = Array.from({ length: 1000 }, (_, i) => {
      return { ...one, ...known, name: `Action${String(i).padStart(4, "0")}`, document: `d${i}` };
    });
    await route.fulfill({ json });
  });
  const drawnRows = (list: Locator) =>
    list.evaluateAll(
      (rows) => rows.filter((row) => row.checkVisibility({ contentVisibilityAuto: true })).length,
    );
  const check = async (list: Locator) => {
    await expect(list).toHaveCount(1000);
    await expect.poll(() => drawnRows(list)).toBeLessThan(150);
    // What is led to is there, wherever it is.
    await list.last().scrollIntoViewIfNeeded();
    await expect(list.last()).toBeInViewport();
    await expect.poll(() => drawnRows(list)).toBeLessThan(150);
  };
  await page.goto(`${product.url}/actions`);
  await check(page.getByRole("navigation", { name: "Actions" }).locator("[data-row]"));
  await page.goto(`${product.url}/graphs/${graph}`);
  await pane(page).getByText("Actions", { exact: true }).click();
  await check(pane(page).locator("button[title^=Action]"));
  expect(failures).toEqual([]);
  await context.close();
});
