/** The audit of an owner: by keys, with a filter, with the runner frozen, as a file and on a phone. */

import { readFileSync } from "node:fs";
import { expect, test } from "@playwright/test";
import { LONG, Product } from "./product";
import { violations } from "./valves";

const product = new Product();
const PICTURES = process.env.PICTURES_OF_AUDIT;

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("an owner finds who did what, without a mouse, also while the runner is frozen", async ({
  browser,
}) => {
  const { page } = await product.person(browser, "Ada");
  await page.request.post(`${product.url}/api/graphs`, {
    data: { name: "=SUM(A1)" },
    headers: { origin: product.url },
  });
  await page.getByRole("button", { name: /^You are/ }).focus();
  await page.keyboard.press("Enter");
  await page.getByRole("link", { name: "Audit" }).focus();
  await page.keyboard.press("Enter");
  const rows = page.getByRole("region", { name: "Audit" }).getByRole("listitem");
  const made = rows.filter({ hasText: "Ada made the graph =SUM(A1)" });
  await expect(made).toContainText("this computer, session");
  await expect(rows.filter({ hasText: "Ada signed in" }).first()).toBeVisible();
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    expect(await violations(page)).toEqual([]);
    if (PICTURES) await page.screenshot({ path: `${PICTURES}/${colorScheme}.png` });
  }
  await page.getByLabel("Words").fill("made =sum");
  await expect(page).toHaveURL(/text=made/);
  await expect(rows).toHaveCount(1);
  const download = page.waitForEvent("download");
  await page.getByRole("button", { name: "CSV" }).press("Enter");
  const csv = readFileSync(await (await download).path(), "utf8");
  expect(csv).toContain(",Ada,");
  expect(csv).toContain(",'=SUM(A1),");
  await page.setViewportSize({ width: 390, height: 844 });
  expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBeLessThanOrEqual(390);
  if (PICTURES) await page.screenshot({ path: `${PICTURES}/phone.png` });
  process.kill(product.pid("runner"), "SIGSTOP");
  try {
    await page.reload();
    await expect(page.getByText("The part of the runner is missing here")).toBeVisible();
    await expect(made).toBeVisible();
    if (PICTURES) await page.screenshot({ path: `${PICTURES}/frozen.png` });
  } finally {
    process.kill(product.pid("runner"), "SIGCONT");
  }
  await made.getByRole("link", { name: "Graph" }).press("Enter");
  await expect(page).toHaveURL(/\/graphs\//);
});
