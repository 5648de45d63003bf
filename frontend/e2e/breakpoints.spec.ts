/** Breakpoints on the canvas: set by key, menu and details, with conditions, for everybody. */

import { expect, test } from "@playwright/test";
import { pick, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("breakpoints are set on actions and arrows, and the start says how many count", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(2);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  const marks = page.locator("[data-breakpoint]");

  await pick(page, ["Wait", 0]);
  await page.keyboard.press("F9");
  await expect(marks).toHaveCount(1);
  await page.locator('[aria-label^="Arrow from Wait 0, when true"]').focus();
  await page.keyboard.press("Enter");
  await page.getByRole("switch", { name: "Breakpoint" }).click();
  await expect(marks).toHaveCount(2);

  await pick(page, ["Wait", 0]);
  await page.getByLabel("Only at visit").fill("7");
  await expect(page.getByTitle("A led run waits before this: visit 7")).toBeVisible();
  await saved(page);
  if (process.env.SHOTS) await page.screenshot({ path: `${process.env.SHOTS}/desktop.png` });

  // A colleague on a phone sees them too; no file has them.
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true };
  const mari = await product.person(browser, "Mari", { ...phone, colorScheme: "dark" });
  await mari.page.goto(`${product.url}/graphs/${id}`);
  await expect(mari.page.locator("[data-breakpoint]")).toHaveCount(2);
  if (process.env.SHOTS) await mari.page.screenshot({ path: `${process.env.SHOTS}/phone.png` });
  const file = await product.ask<object>(`/api/graphs/${id}/umrf`);
  expect(JSON.stringify(file)).not.toContain("breakpoint");

  await page.getByRole("button", { name: /^Start/ }).first().click();
  const dialog = page.getByRole("dialog");
  if (!(await dialog.isVisible())) await page.getByRole("menuitem", { name: /Look/ }).click();
  await expect(dialog.getByText("2 breakpoints")).toBeVisible();
  if (process.env.SHOTS) await page.screenshot({ path: `${process.env.SHOTS}/start.png` });
  await page.keyboard.press("Escape");

  await pick(page, ["Wait", 0]);
  await page.keyboard.press("F9");
  await expect(marks).toHaveCount(1);
  await page.keyboard.press("ControlOrMeta+z");
  await expect(marks).toHaveCount(2);
  expect([...failures, ...mari.failures]).toEqual([]);
  await mari.context.close();
  await context.close();
});
