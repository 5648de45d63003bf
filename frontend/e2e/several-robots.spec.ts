/** Two people draw a task of two robots, see whose each action is and who waits for whom, and play it. */

import { expect, type Page, test } from "@playwright/test";
import { atRest, card, connect, enter, fitView, saved, setRobot } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** Adds an action by its name, whether the library knows it or not. */
async function add(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Add an action" }).first().click();
  const field = page.getByRole("combobox", { name: "Name of an action" });
  await field.fill(name);
  await page.getByRole("option", { name }).first().click();
  await expect(card(page, name)).toBeVisible();
}

const arrow = (page: Page) => page.locator('[aria-label*="Scout waits for Carrier"]');

test("two people draw what Scout does when Carrier has arrived, and play it to its end", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada");
  const mari = await product.person(browser, "Mari");
  const { page } = ada;
  await page.goto(product.url);
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  await mari.page.goto(page.url());
  await add(page, "Arrive");
  await enter(page, "Arrive");
  await add(page, "Inspect");
  await expect(card(mari.page, "Inspect")).toBeVisible();
  await connect(mari.page, "Arrive", "true", "Inspect");
  await fitView(page);
  await connect(page, "Inspect", "true", "exit");

  // One robot needs no name on its cards; two have theirs, for both people.
  await setRobot(page, "Arrive", "Carrier");
  await saved(page);
  await expect(card(page, "Arrive").locator("[data-robot]")).toHaveCount(0);
  await setRobot(mari.page, "Inspect", "Scout");
  for (const each of [page, mari.page]) {
    await expect(card(each, "Arrive").locator("[data-robot]")).toHaveText("Carrier");
    await expect(card(each, "Inspect").locator("[data-robot]")).toHaveText("Scout");
    await expect(arrow(each)).toBeAttached();
    await expect(each.locator("[data-hand]")).toHaveAttribute("title", "Scout waits for Carrier");
  }

  // By keys: from the action that waits to its arrow, which says who starts what.
  await card(mari.page, "Inspect").click({ position: { x: 40, y: 24 } });
  const waits = mari.page.getByRole("button", { name: "Waits for Carrier: Arrive" });
  await waits.focus();
  await mari.page.keyboard.press("Enter");
  await expect(
    mari.page.getByText("Scout starts Inspect when Carrier’s Arrive ends true."),
  ).toBeVisible();

  // The start says where it can go before anything is pressed.
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  const lead = page.getByRole("radio", { name: /^Lead it step by step/ });
  await expect(lead).toBeChecked();
  await expect(page.getByRole("combobox", { name: "Robot for Scout" })).toHaveValue("simulator");
  await page.keyboard.press("Escape");

  // A dry-run says for whom it waits, and goes to its end.
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Dry-run", exact: true }).click();
  await expect(card(page, "Inspect")).toContainText("waits for Carrier: Arrive");
  await atRest(page);
  const scrub = page.getByRole("slider", { name: "Moment" });
  await scrub.press("End");
  await expect(card(page, "Inspect")).toContainText("true");
  await expect(card(page, "Inspect")).not.toContainText("waits");
});
