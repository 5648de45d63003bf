/** The page for those who do not use a mouse, or do not see it. */

import { expect, test } from "@playwright/test";
import { saved } from "./bench";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

async function graph(name: string): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  return `${product.url}/graphs/${graphs.find((each) => each.name === name)?.id}`;
}

test("the keyboard goes past the bar at once, sees where it is, and hears what others do", async ({
  browser,
}) => {
  const ada = await product.person(browser, "Ada");
  const mari = await product.person(browser, "Mari");
  const url = await graph("search_aisles");
  for (const { page } of [ada, mari]) {
    await page.goto(url);
    await saved(page);
  }
  await ada.page.keyboard.press("Tab");
  const skip = ada.page.getByRole("button", { name: "Skip to the content" });
  await expect(skip).toBeFocused();
  await expect(skip).toBeInViewport();
  await ada.page.keyboard.press("Enter");
  await expect(ada.page.getByRole("main")).toBeFocused();
  await ada.page.keyboard.press("Tab");
  const ring = await ada.page.evaluate(() => {
    const style = getComputedStyle(document.activeElement ?? document.body);
    return style.outlineStyle !== "none" || style.boxShadow !== "none";
  });
  expect(ring).toBe(true);

  const name = mari.page.getByRole("textbox", { name: "Graph", exact: true });
  await name.fill("other_name");
  await name.press("Enter");
  await mari.page.keyboard.press("Escape");
  await mari.page.getByRole("button", { name: "Undo" }).click();
  await mari.page
    .locator(".react-flow__node-action")
    .first()
    .click({ position: { x: 50, y: 30 } });
  const robot = mari.page.getByRole("combobox", { name: "Robot" });
  await robot.fill("rover");
  await robot.press("Tab");
  const heard = ada.page.getByRole("status", { name: "What happens" });
  await expect(heard).toContainText(/Mari changed/);
  await ada.context.close();
  await mari.context.close();
});
