/** Tasks in levels: into the graph for which an action stands, out again, by mouse, keys and touch. */

import { expect, type Page, test } from "@playwright/test";
import { boxOf, card, saved, start } from "./canvas";
import { type Person, Product } from "./product";
import { post, violations } from "./valves";

const product = new Product();
let ada: Person;
let round: string;

const named = (name: string) => ({ name, instance_id: 0 });
const single = (graph: string, name: string) => ({
  graph_name: graph,
  graph_entry: [named(name)],
  graph_exit: [named(name)],
  actions: [{ ...named(name), type: "sync" }],
});

test.describe.configure({ mode: "serial" });
test.beforeAll(async ({ browser }) => {
  await product.start();
  await post(product, "/api/graphs", single("Grip", "CloseFingers"));
  await post(product, "/api/graphs", single("Fetch", "Grip"));
  round = (await post<{ id: string }>(product, "/api/graphs", single("Round", "Fetch"))).id;
  ada = await product.person(browser, "Ada");
  await ada.page.goto(`${product.url}/graphs/${round}`);
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

const where = (page: Page) => page.getByRole("navigation", { name: "Where you are" });
/** The dialog about one graph without graphs inside. */
async function asked(page: Page) {
  await saved(page);
  await page.keyboard.press("Control+k");
  await page.keyboard.type("one graph without");
  await page.keyboard.press("Enter");
  return page.getByRole("dialog", { name: "One graph without graphs inside" });
}

const inside = (page: Page, name: string) =>
  card(page, name).getByRole("button", { name: `Open the graph inside ${name}` });

test("one goes in by the sign, a double click and ], and out by the line of levels and [", async () => {
  const { page } = ada;
  await saved(page);
  await inside(page, "Fetch").click();
  await expect(where(page)).toContainText("Graphs/Round/Fetch");
  await expect(card(page, "Grip")).toBeVisible();
  await card(page, "Grip").dblclick();
  await expect(where(page)).toContainText("Graphs/Round/Fetch/Grip");
  await expect(card(page, "CloseFingers")).toBeVisible();
  await expect(inside(page, "CloseFingers")).toHaveCount(0);
  expect(await violations(page)).toEqual([]);

  await page.keyboard.press("[");
  await expect(card(page, "Grip")).toHaveClass(/\bselected\b/);
  await expect(where(page)).toContainText("Graphs/Round/Fetch/Grip");
  await page.keyboard.press("]");
  await expect(card(page, "CloseFingers")).toBeVisible();

  await where(page).getByRole("link", { name: "Round" }).click();
  await expect(card(page, "Fetch")).toHaveClass(/\bselected\b/);
  await expect(page).toHaveURL(new RegExp(`/graphs/${round}\\?action=`));
});

test("an address names its level: a colleague who opens it stands in it, and finds out", async ({
  browser,
}) => {
  await ada.page.keyboard.press("]");
  await expect(card(ada.page, "Grip")).toBeVisible();
  const mari = await product.person(browser, "Mari");
  await mari.page.goto(ada.page.url());
  await expect(where(mari.page)).toContainText("Graphs/Round/Fetch");
  await expect(card(mari.page, "Grip")).toBeVisible();
  await mari.page.locator(".react-flow__pane").click({ position: { x: 20, y: 20 } });
  await mari.page.keyboard.press("Control+ArrowUp");
  await expect(card(mari.page, "Fetch")).toHaveClass(/\bselected\b/);
  expect(mari.failures).toEqual([]);
  await mari.context.close();
});

test("a graph that others run inside says so, and which they are", async () => {
  const { page } = ada;
  await page.getByRole("button", { name: "Used in 1 graph" }).click();
  await expect(page.getByRole("menu")).toContainText("Your changes here apply in each");
  await page.getByRole("menuitem", { name: "Round" }).click();
  await expect(card(page, "Fetch")).toBeVisible();
  await expect(where(page)).toContainText("Graphs/Round");
  await expect(page.getByRole("button", { name: /^Used in/ })).toHaveCount(0);
});

test("a version says what is inside of it, and what of that is otherwise now", async () => {
  const { page } = ada;
  const version = await post<{ id: string }>(product, `/api/graphs/${round}/versions`, {});
  const { subgraphs } = await product.ask<{ subgraphs: { name: string; graph: string }[] }>(
    `/api/versions/${version.id}`,
  );
  const grip = subgraphs.find(({ name }) => name === "Grip")?.graph ?? "";
  const { seq } = await product.ask<{ seq: number }>(`/api/graphs/${grip}`);
  const edited = single("Grip", "CloseFingers");
  const actions = edited.actions.map((each) => ({ ...each, type: "async" }));
  await product.ask(`/api/graphs/${grip}/umrf?seq=${seq}`, {
    method: "PUT",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({ ...edited, actions }),
  });

  await page.goto(`${product.url}/graphs/${round}?history`);
  await page.getByRole("radiogroup", { name: "What of the history" }).getByText("Versions").click();
  await page.getByRole("button", { name: /^v1/ }).click();
  const parts = page.getByRole("list", { name: "Graphs inside of it" }).getByRole("listitem");
  await expect(parts).toHaveText([/^Fetch.*as it is now$/, /^Grip.*changed since$/]);
  expect(await violations(page)).toEqual([]);
});

test("what runs is seen at its own level, while it runs and in the replay", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${round}`);
  await saved(page);
  await start(page);
  await page.keyboard.press("Escape");
  await inside(page, "Fetch").click();
  await inside(page, "Grip").click();
  const state = card(page, "CloseFingers").locator("[data-state]");
  await expect(state).toHaveAttribute("data-state", /running|true/);
  await expect(card(page, "CloseFingers").locator("[data-state='true']")).toBeVisible();
  await page.reload();
  await expect(card(page, "CloseFingers")).toBeVisible();
  const { x, y, width, height } = await boxOf(page.locator("[data-ruler]").first());
  await page.mouse.click(x + width * 0.98, y + height / 2);
  await expect(state).toHaveAttribute("data-state", /running|true/);
});

test("a task of three levels becomes one graph of its own, or it is said why not", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${round}`);
  await expect(inside(page, "Fetch")).toBeVisible();
  const dialog = await asked(page);
  await expect(dialog.getByRole("list", { name: "Where its actions come from" })).toContainText(
    "CloseFingers_0Fetch_0 › Grip_0 › CloseFingers_0",
  );
  await expect(dialog.getByRole("textbox", { name: "Name of the new graph" })).toHaveValue(
    "Round flat",
  );
  expect(await violations(page)).toEqual([]);
  await dialog.getByRole("button", { name: "Make it" }).click();
  await expect(where(page)).toContainText("Graphs/Round flat");
  await expect(card(page, "CloseFingers")).toBeVisible();

  const never = { ...single("Round", "Fetch"), graph_name: "Odd" };
  const actions = never.actions.map((each) => ({ ...each, type: "spontaneous" }));
  const odd = await post<{ id: string }>(product, "/api/graphs", { ...never, actions });
  await page.goto(`${product.url}/graphs/${odd.id}`);
  await expect(inside(page, "Fetch")).toBeVisible();
  const refused = await asked(page);
  await expect(refused).toContainText("none is made");
  await refused.getByRole("button", { name: "Fetch_0" }).first().click();
  await expect(card(page, "Fetch")).toHaveClass(/\bselected\b/);
});

test("on a phone a tap leads in and another one out", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", {
    viewport: { width: 390, height: 780 },
    hasTouch: true,
    isMobile: true,
  });
  await page.goto(`${product.url}/graphs/${round}`);
  await page.getByRole("tab", { name: "Canvas" }).or(page.getByText("Canvas")).first().tap();
  await inside(page, "Fetch").tap();
  await expect(card(page, "Grip")).toBeVisible();
  await page.getByRole("button", { name: "Out" }).tap();
  await expect(card(page, "Fetch")).toHaveClass(/\bselected\b/);
  expect(failures).toEqual([]);
  await context.close();
});
