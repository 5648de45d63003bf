/** The documentation that comes with the product, from the menu of one's name to what is searched. */

import { expect, test } from "@playwright/test";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("Help is searched, and leads to what to do at STOP UNCONFIRMED", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.getByRole("button", { name: /Name and appearance/ }).click();
  const opening = context.waitForEvent("page");
  await page.getByRole("link", { name: "Help" }).click();
  const help = await opening;
  await help.waitForLoadState();
  const refused: string[] = [];
  help.on("console", (message) => {
    if (message.type() === "error") refused.push(message.text());
  });
  help.on("pageerror", (error) => refused.push(error.message));
  const asked: string[] = [];
  help.on("request", (request) => asked.push(request.url()));
  await help.reload();
  await expect(help.getByRole("heading", { name: "Help", level: 1 })).toBeVisible();

  const field = help.getByRole("textbox", { name: "Search" }).first();
  await field.fill("unconfirmed");
  await field.press("Enter");
  const found = help.getByRole("link", { name: /> STOP UNCONFIRMED$/ });
  await expect(found).toBeVisible();
  await found.click();
  await help.waitForURL(/operators-guide\.html(\?.*)?#stop-unconfirmed$/);
  await expect(help.getByText("Assume that the robot moves.")).toBeInViewport();

  // On a phone the table of what the page says stays within it.
  await help.setViewportSize({ width: 390, height: 844 });
  expect(await help.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);

  expect(asked.filter((url) => !url.startsWith(`${product.url}/help/`))).toEqual([]);
  expect(refused).toEqual([]);
  expect(failures).toEqual([]);
  await context.close();
});
