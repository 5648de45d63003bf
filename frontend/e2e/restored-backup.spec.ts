/** A backup is restored while people work: nothing is merged blindly, and nothing is lost unasked. */

import { readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { add, atRest, card, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();
let graph = "";

test.beforeAll(async () => {
  await product.start();
  const body = JSON.stringify({ name: "task" });
  const headers = { "content-type": "application/json" };
  const made = await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers });
  graph = made.id;
});
test.afterAll(() => product.dispose());

async function stored(): Promise<string[]> {
  const file = await product.ask<{ actions: { name: string }[] }>(`/api/graphs/${graph}/umrf`);
  return file.actions.map(({ name }) => name).sort();
}

async function enter(page: Page): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
}

async function renameTo(page: Page, from: string, to: string): Promise<void> {
  await card(page, from).click({ position: { x: 50, y: 30 } });
  const field = page.getByRole("textbox", { name: "Name", exact: true });
  await field.fill(to);
  await field.press("Enter");
  await expect(card(page, to)).toBeVisible();
}

/** Takes pictures in every width and colour scheme, to be looked at; only in `make soak`. */
async function pictures(page: Page, name: string): Promise<void> {
  if (LONG !== "") return;
  for (const scheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme: scheme });
    for (const width of [1440, 390]) {
      await page.setViewportSize({ width, height: width === 390 ? 844 : 900 });
      await atRest(page);
      await page.screenshot({ path: test.info().outputPath(`${name}-${scheme}-${width}.png`) });
    }
  }
  await page.emulateMedia({ colorScheme: "light" });
  await page.setViewportSize({ width: 1440, height: 900 });
}

test("after a restore each person decides about the edits that waited, and sees the values", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  test.setTimeout(150_000);
  const ada = await product.person(browser, "Ada");
  const mari = await product.person(browser, "Mari");
  await enter(ada.page);
  for (const name of ["Look", "Grip"]) await add(ada.page, name);
  await saved(ada.page);
  const file = join(product.data, "backup.zip");
  expect(await product.command("backup", file)).toContain("all of them sound");
  await add(ada.page, "AfterTheBackup");
  await saved(ada.page);
  await enter(mari.page);
  await expect(card(mari.page, "AfterTheBackup")).toBeVisible();

  await product.kill();
  await renameTo(ada.page, "Look", "Peek");
  await card(ada.page, "Grip").click({ position: { x: 50, y: 30 } });
  await ada.page.keyboard.press("Delete");
  await add(ada.page, "Mine");
  await expect(ada.page.getByText(/Server away with \d+ change/)).toBeVisible();
  await product.command("restore", file);
  await product.start();

  // Nothing of Mari's waited: she sees the graph as it is now, and why.
  await expect(mari.page.getByText(/A backup was restored/)).toBeVisible({ timeout: 30_000 });
  await expect(card(mari.page, "AfterTheBackup")).toHaveCount(0);
  await mari.page.getByRole("button", { name: "Close the note" }).click();
  await expect(mari.page.getByText(/A backup was restored/)).toHaveCount(0);

  const dialog = ada.page.getByRole("dialog", { name: /restored backup/ });
  await expect(dialog).toBeVisible({ timeout: 30_000 });
  const list = dialog.getByRole("list", { name: "Your changes" });
  await expect(list.getByRole("checkbox")).toHaveCount(3);
  await expect(list).toContainText(/Name\s*Look\s*→\s*becomes\s*Peek/);
  expect(await stored()).toEqual(["Grip", "Look"]);
  await pictures(ada.page, "choice");

  await dialog.getByRole("checkbox", { name: "removed action Grip" }).uncheck();
  await dialog.getByRole("button", { name: "Apply 2 of 3" }).click();
  await expect(dialog).toHaveCount(0);
  await saved(ada.page);
  expect(await stored()).toEqual(["Grip", "Mine", "Peek"]);
  for (const page of [ada.page, mari.page]) {
    for (const name of ["Grip", "Mine", "Peek"]) await expect(card(page, name)).toBeVisible();
  }
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await ada.context.close();
  await mari.context.close();
});

test("who decides later is asked again, can save the changes as a file, and discard them", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  test.setTimeout(120_000);
  const ada = await product.person(browser, "Ada");
  await enter(ada.page);
  const before = await stored();
  await product.kill();
  await add(ada.page, "Wavering");
  await expect(ada.page.getByText(/Server away with \d+ change/)).toBeVisible();
  await product.command("restore", join(product.data, "backup.zip"));
  await product.start();
  const dialog = ada.page.getByRole("dialog", { name: /restored backup/ });
  await dialog.getByRole("button", { name: "Decide later" }).last().click({ timeout: 30_000 });
  await expect(dialog).toHaveCount(0);
  await expect(ada.page.getByText(/1 edit waits for your decision/)).toBeVisible();
  await pictures(ada.page, "later");
  await add(ada.page, "Meanwhile"); // work goes on in the graph as it is now
  await saved(ada.page);

  await ada.page.reload();
  await expect(dialog.getByText("Wavering").first()).toBeVisible({ timeout: 30_000 });
  const downloading = ada.page.waitForEvent("download");
  await dialog.getByRole("button", { name: "Save as a file" }).click();
  const download = await downloading;
  const saved_ = JSON.parse(readFileSync(await download.path(), "utf8"));
  expect(saved_).toMatchObject({ graph: "task", made_by: "Ada" });
  expect(saved_.changes[0].what).toBe("added action Wavering");
  await dialog.getByRole("button", { name: "Discard", exact: true }).click();
  await dialog.getByRole("button", { name: "Discard for good" }).click();
  await expect(dialog).toHaveCount(0);
  await ada.page.reload();
  await saved(ada.page);
  await expect(dialog).toHaveCount(0);
  expect(before).toContain("Peek");
  expect(await stored()).toEqual(["Grip", "Look", "Meanwhile"]);
  expect(ada.failures).toEqual([]);
  await ada.context.close();
});
