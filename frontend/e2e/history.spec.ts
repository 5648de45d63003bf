/** Somebody finds out who broke a graph, looks at how it was, and takes it back. */

import { expect, type Page, test } from "@playwright/test";
import { add, boxOf, card, saved, umrfOf } from "./canvas";
import { type Person, Product } from "./product";
import { choose, post, ran, setSpeed, VALVES, violations } from "./valves";

const product = new Product();
let ada: Person;
let mari: Person;
let graph: string;

test.beforeAll(async ({ browser }) => {
  await product.start();
  graph = (await post<{ id: string }>(product, "/api/graphs", VALVES)).id;
  ada = await product.person(browser, "Ada");
  mari = await product.person(browser, "Mari");
  for (const { page } of [ada, mari]) await page.goto(`${product.url}/graphs/${graph}`);
  await setSpeed(ada.page, "0.9");
  await ran(product, graph);
  // Mari breaks it: an action is gone, and with it the way to the end.
  await choose(mari.page, "Cool");
  await mari.page.keyboard.press("Delete");
  await expect(card(mari.page, "Cool")).toHaveCount(0);
  await saved(mari.page);
});

test.afterAll(async () => {
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await product.dispose();
});

const panel = (page: Page) => page.getByRole("region", { name: "History" });
const entries = (page: Page) => panel(page).getByRole("listitem");
const bar = (page: Page) => page.getByRole("region", { name: "The past" });
const moment = (page: Page) => page.getByRole("slider", { name: "Moment of the past" });

async function openHistory(page: Page): Promise<void> {
  await page.getByRole("radiogroup", { name: "What is listed" }).getByText("History").click();
}

test("the list says who did what, between versions and runs", async () => {
  const { page } = ada;
  await openHistory(page);
  const broke = entries(page).filter({ hasText: "Mari" });
  await expect(broke).toContainText("removed Cool and its 2 arrows");
  await expect(entries(page).filter({ hasText: "set Drive speed" })).toContainText("0.4 → 0.9");
  await expect(entries(page).filter({ hasText: "Run 1" })).toContainText("finished");
  await expect(entries(page).filter({ hasText: "kept by" })).toContainText("v1");
  const kinds = await entries(page).allTextContents();
  const order = [/Mari/, /Run 1/, /v1/, /set Drive/, /imported/].map((what) =>
    kinds.findIndex((text) => what.test(text)),
  );
  expect(order).toEqual([...order].sort((a, b) => a - b));
});

test("the past is looked at and changes nothing; what others do goes on", async () => {
  const { page } = ada;
  await entries(page).filter({ hasText: "Mari" }).getByRole("button").first().click();
  await expect(bar(page)).toContainText("You look at the past.");
  // What is gone stands where it stood, and is marked.
  await expect(card(page, "Cool").locator('[data-change="removed"]').first()).toBeVisible();
  await expect(bar(page).getByRole("list", { name: "What differs" })).toContainText(
    "1 card, 2 arrows",
  );
  await page.keyboard.press("n");
  await expect(bar(page).getByRole("status")).toContainText("1 of 3 · Cool removed");
  await page.keyboard.press("Delete");
  await page.keyboard.press("a");
  await expect(page.getByRole("combobox", { name: "Name of an action" })).toHaveCount(0);
  await expect(page.getByText("STOP", { exact: true }).first()).toBeVisible();

  await moment(page).press("Home");
  await expect(card(page, "Drive")).toContainText("0.4");
  await expect(page).toHaveURL(/[?&]at=1(&|$)/);
  await moment(page).press("ArrowRight");
  await expect(card(page, "Drive")).toContainText("0.9");
  await setSpeed(mari.page, "1.5");
  await add(mari.page, "Wave");
  await saved(mari.page);
  await expect(card(page, "Wave")).toHaveCount(0);
  const then = page.url();
  await moment(page).press("Escape");
  await expect(bar(page)).toHaveCount(0);
  await expect(card(page, "Wave")).toBeVisible();
  await page.goto(then);
  await expect(card(page, "Drive")).toContainText("0.9");
  await page.getByRole("button", { name: "Back to now" }).click();
  await expect(page).not.toHaveURL(/at=/);
});

test("who set a value is told, with what it was", async () => {
  const { page } = ada;
  await openHistory(page);
  await choose(page, "Drive");
  const fields = page.getByRole("list", { name: "Who set what" }).getByRole("listitem");
  const row = fields.filter({ hasText: "speed" });
  await expect(row).toContainText(/0\.9\s*1\.5.*Mari/);
  await row.getByRole("button").first().click();
  await expect(page.getByRole("table", { name: "Values of speed" })).toContainText(/0\.9.*Ada/);
  expect(await violations(page)).toEqual([]);
  await page.keyboard.press("Escape");
});

test("what is another since it went well is one press away", async () => {
  const { page } = ada;
  await openHistory(page);
  const since = panel(page).getByRole("button", { name: "What changed since run 1" });
  await since.click();
  const compared = bar(page).getByRole("combobox", { name: "Compare with" });
  await expect(compared.locator("option:checked")).toHaveText("the last good run before it, run 1");
  const differs = bar(page).getByRole("list", { name: "What differs" });
  await expect(differs).toContainText("1 card, 2 arrows");
  await expect(card(page, "Wave").locator('[data-change="added"]').first()).toBeVisible();
  await since.click();
  await expect(bar(page)).toHaveCount(0);
});

test("what broke it is undone", async () => {
  const { page } = ada;
  await openHistory(page);
  const broke = entries(page).filter({ hasText: "removed Cool" });
  await broke.getByRole("button").first().click();
  await expect(bar(page)).toBeVisible();
  expect(await violations(page)).toEqual([]);
  await broke.getByRole("button", { name: "Undo what Mari did" }).click();
  await expect(bar(page)).toHaveCount(0);
  for (const each of [page, mari.page]) await expect(card(each, "Cool")).toBeVisible();
  await expect(entries(page).first()).toContainText("undid what Mari did");
  const { actions } = await umrfOf(product, graph);
  expect(actions.map(({ name }) => name).sort()).toEqual(["Cool", "Drive", "Report"]);
});

test("beside the open list a moment of the past is looked at whole, and restored there", async ({
  browser,
}) => {
  await add(ada.page, "Nod");
  await saved(ada.page);
  const eve = await product.person(browser, "Eve", { panels: "folded" });
  const { page } = eve;
  await page.goto(`${product.url}/graphs/${graph}`);
  const counts = page.getByTitle(/prevents? a start$/).filter({ visible: true });
  await expect(card(page, "Nod")).toBeVisible();
  await expect(counts.first()).toBeVisible();
  await page.getByRole("button", { name: "History", exact: true }).click();
  await entries(page).filter({ hasText: "imported" }).getByRole("button").first().click();
  await expect(card(page, "Nod")).toHaveCount(0);
  await expect(counts).toHaveCount(0); // they are those of now
  const list = await boxOf(page.getByRole("complementary", { name: "Library" }));
  const title = await boxOf(bar(page).getByText("You look at the past."));
  expect(title.x).toBeGreaterThanOrEqual(list.x + list.width);
  await bar(page).getByRole("button", { name: "Restore" }).click();
  await expect(bar(page)).toHaveCount(0);
  await expect(card(page, "Drive")).toContainText("0.4");
  await expect(card(ada.page, "Nod")).toHaveCount(0);

  // It is undone by its person as any edit, and by nobody else.
  await add(ada.page, "Bow");
  await expect(card(page, "Bow")).toBeVisible();
  await page.keyboard.press("ControlOrMeta+z");
  for (const each of [page, ada.page]) {
    await expect(card(each, "Nod")).toBeVisible();
    await expect(card(each, "Drive")).toContainText("0.9");
    await expect(card(each, "Bow")).toBeVisible();
  }
  await page.keyboard.press("ControlOrMeta+Shift+z");
  for (const each of [page, ada.page]) await expect(card(each, "Nod")).toHaveCount(0);
  await expect(card(page, "Bow")).toBeVisible();
  expect(eve.failures).toEqual([]);
});
