/** Two people build a task of two levels, each on another level of it, run it, and look at it again inside. */

import { expect, type Page, test } from "@playwright/test";
import { add, boxOf, card, connect, move, pick, saved, start, tidy } from "./canvas";
import { LONG, type Person, Product } from "./product";
import { violations } from "./valves";

const product = new Product();
let ada: Person;
let mari: Person;

test.skip(LONG !== "", LONG);
test.describe.configure({ mode: "serial" });
test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
  mari = await product.person(browser, "Mari");
});
test.afterAll(async () => {
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await product.dispose();
});

const inner = (page: Page, name: string) => page.locator(`[data-inner][data-name="${name}"]`);
const state = (page: Page, name: string) => card(page, name).locator("[data-state]");

test("one draws it and takes a part out, the other goes on inside", async () => {
  const { page } = ada;
  await page.goto(product.url);
  await page.getByRole("button", { name: "New graph" }).first().click();
  await add(page, "Drive");
  await add(page, "Grip");
  await add(page, "Lift");
  await move(page, "Grip", [0, 160], "Drive");
  await move(page, "Lift", [0, 320], "Drive");
  await connect(page, "Drive", "true", "Grip");
  await connect(page, "Grip", "true", "Lift");
  await connect(page, "Lift", "true", "exit");
  await tidy(page);
  await saved(page);
  await mari.page.goto(page.url());
  await expect(card(mari.page, "Lift")).toBeVisible();

  await pick(page, ["Grip", 0], ["Lift", 0]);
  await page.keyboard.press("ControlOrMeta+g");
  const dialog = page.getByRole("dialog", { name: "A sub-graph of 2 actions" });
  await dialog.getByRole("textbox", { name: "Name of the new graph" }).fill("Take");
  await dialog.getByRole("button", { name: /^Make it/ }).click();
  await expect(card(mari.page, "Take")).toBeVisible();
  await saved(page);

  const other = mari.page;
  await other.getByRole("button", { name: "Open the graph inside Take" }).click();
  await expect(card(other, "Lift")).toBeVisible();
  await page.getByRole("button", { name: "Expand the graph inside Take" }).click();
  await expect(inner(page, "Lift")).toBeVisible();
  await add(other, "LookAgain");
  await connect(other, "Lift", "false", "LookAgain");
  await saved(other);
  await expect(inner(page, "LookAgain")).toBeVisible({ timeout: 30_000 });
});

test("it runs, each sees it on their own level, and it is replayed inside", async () => {
  const { page } = ada;
  const other = mari.page;
  await saved(page);
  await start(page);
  await expect(inner(page, "Grip")).toHaveAttribute("data-state", "running");
  await expect(state(other, "Lift")).toHaveAttribute("data-state", "running");
  await expect(inner(page, "Lift")).toHaveAttribute("data-state", "true");
  await expect(state(other, "Lift")).toHaveAttribute("data-state", "true");

  const ruler = other.locator("[data-ruler]").first();
  const { x, y, width, height } = await boxOf(ruler);
  await other.mouse.click(x + width * 0.02, y + height / 2);
  await expect(card(other, "Lift").locator("[data-state='true']")).toHaveCount(0);
  await other.mouse.click(x + width * 0.98, y + height / 2);
  await expect(state(other, "Grip")).toHaveAttribute("data-state", "true");
  expect(await violations(other)).toEqual([]);
});
