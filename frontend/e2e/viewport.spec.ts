/** What is seen: text stays readable on opening, Fit twice shows the whole, the view follows a run. */

import { expect, type Page, test } from "@playwright/test";
import { card, saved, start } from "./canvas";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const zoom = (page: Page) =>
  page
    .locator(".react-flow__viewport")
    .evaluate((element) => new DOMMatrix(getComputedStyle(element).transform).a);

for (const [what, viewport, least] of [
  ["a desktop", { width: 1440, height: 900 }, 0.75],
  ["a phone", { width: 390, height: 844 }, 0.6],
] as const) {
  test(`a tall graph opens at its top and readable on ${what}`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada", { viewport });
    await page.goto(`${product.url}/graphs/${await product.chain(20)}`);
    await saved(page);
    await expect.poll(() => zoom(page)).toBeCloseTo(least, 2);
    await expect(card(page, "Wait", 0)).toBeInViewport();
    await expect(card(page, "Wait", 19)).not.toBeInViewport();

    // Fit once more shows the rest too; and again the readable part.
    const fit = page.getByRole("button", { name: "Fit", exact: true });
    await fit.click();
    await expect(card(page, "Wait", 19)).toBeInViewport();
    await expect.poll(() => zoom(page)).toBeLessThan(least);
    await fit.click();
    await expect.poll(() => zoom(page)).toBeCloseTo(least, 2);
    await context.close();
  });
}

test("the view follows what runs until the person moves it, and again when asked", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(60)}`);
  await saved(page);
  await start(page);
  await expect(card(page, "Wait", 6)).toBeInViewport({ timeout: 30_000 });
  await expect(page.getByRole("list", { name: /Actions of the run/ })).toBeVisible();

  await page.getByRole("button", { name: "Hide the lanes" }).click();
  await expect(page.getByRole("list", { name: /Actions of the run/ })).toHaveCount(0);
  await page.getByRole("button", { name: "Show the lanes" }).click();

  const box = await page.locator(".react-flow__pane").boundingBox();
  if (box === null) throw new Error("no canvas");
  await page.mouse.move(box.x + 60, box.y + 100);
  await page.mouse.down();
  await page.mouse.move(box.x + 60, box.y + 500, { steps: 5 });
  await page.mouse.up();
  const follow = page.getByRole("button", { name: "Follow the run" });
  await expect(follow).toBeVisible();
  await follow.click();
  await expect(follow).toBeHidden();
  await expect(
    page.locator(".react-flow__node-action").filter({ hasText: "running" }).first(),
  ).toBeInViewport();
  expect(failures).toEqual([]);
  await context.close();
});
