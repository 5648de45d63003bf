/** The page of whoever looks after the installation, in both colours, by keys and on a phone. */

import { expect, test } from "@playwright/test";
import { LONG, Product } from "./product";
import { violations } from "./valves";

const product = new Product();
const PICTURES = process.env.PICTURES_OF_ADMINISTRATION;

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("an owner sees both processes, and what doctor finds, without a mouse", async ({
  browser,
}) => {
  const { page } = await product.person(browser, "Ada");
  await page.getByRole("button", { name: /^You are/ }).focus();
  await page.keyboard.press("Enter");
  await page.getByRole("link", { name: "Administration" }).focus();
  await page.keyboard.press("Enter");
  for (const name of ["Editor", "Runner"]) {
    const card = page.getByRole("region", { name });
    await expect(card.getByText("Ready", { exact: true })).toBeVisible();
    await expect(card).toContainText("Version");
    await expect(card).toContainText("editor.db".replace("editor", name.toLowerCase()));
    await expect(card).toContainText("free");
  }
  await expect(page.getByRole("region", { name: "Backups" })).toContainText("none was made");
  const doctor = page.getByRole("region", { name: "Doctor" });
  await doctor.getByRole("button", { name: "Look for faults" }).press("Enter");
  await expect(doctor.getByRole("status")).toContainText("Checking");
  await expect(doctor.getByRole("button", { name: "Look again" })).toBeEnabled({ timeout: 90_000 });
  await expect(doctor.getByRole("status")).toContainText(/Nothing is wrong|wrong|matter/);
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    expect(await violations(page)).toEqual([]);
    if (PICTURES) await page.screenshot({ path: `${PICTURES}/${colorScheme}.png`, fullPage: true });
  }
  await page.setViewportSize({ width: 390, height: 844 });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  expect(wide).toBeLessThanOrEqual(390);
  if (PICTURES) await page.screenshot({ path: `${PICTURES}/phone.png` });
});

test("a process that does not answer is said to, beside what was known of it", async ({
  browser,
}) => {
  const { page } = await product.person(browser, "Eve");
  await page.goto(`${product.url}/admin`);
  const runner = page.getByRole("region", { name: "Runner" });
  await expect(runner.getByText("Ready", { exact: true })).toBeVisible();
  process.kill(product.pid("runner"), "SIGSTOP");
  try {
    await expect(runner.getByText("No answer")).toBeVisible({ timeout: 30_000 });
    await expect(runner).toContainText("The figures below are from");
    if (PICTURES) await page.screenshot({ path: `${PICTURES}/frozen.png` });
  } finally {
    process.kill(product.pid("runner"), "SIGCONT");
  }
  await expect(runner.getByText("Ready", { exact: true })).toBeVisible({ timeout: 30_000 });
});
