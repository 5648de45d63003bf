/** The main job in containers, through their proxy: `make containers` starts them and names the link. */

import { expect, test } from "@playwright/test";
import { add, card, saved, start } from "./canvas";

const LINK = process.env.CONTAINERS_LINK ?? "";
const GRAPH = process.env.CONTAINERS_GRAPH ?? "";

test.skip(LINK === "", "needs running containers: make containers");
test.use({ ignoreHTTPSErrors: true });

test("somebody signs in, draws, runs and stops at the one origin", async ({ page }) => {
  const failures: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  await page.goto(LINK);
  const field = page.getByRole("textbox", { name: /others see you/i });
  await field.fill("Ada");
  await field.press("Enter");
  await field.waitFor({ state: "detached" });
  expect(await page.evaluate(() => window.isSecureContext)).toBe(true);

  await page.goto(`${new URL(LINK).origin}/graphs/${GRAPH}`);
  await expect(card(page, "Wait")).toBeVisible({ timeout: 45_000 });
  await add(page, "Sooner");
  await saved(page);
  await page.reload();
  await expect(card(page, "Sooner")).toBeVisible({ timeout: 45_000 });
  await saved(page);

  await start(page);
  const stop = page.getByRole("button", { name: /^Stop run/ });
  await expect(stop).toBeVisible();
  await stop.click();
  await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
  const picture = process.env.CONTAINERS_PICTURE;
  if (picture !== undefined) await page.screenshot({ path: picture });
  expect(failures).toEqual([]);
});
