/** Actions in Python, chosen in the dialog of a start. */

import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { LONG, type Person, Product } from "./product";

test.skip(LONG !== "", LONG);
test.describe.configure({ mode: "serial" });

const folder = mkdtempSync(join(tmpdir(), "behaviours-"));
const product = new Product(["--behaviours", folder]);
let ada: Person;

/** A graph of one action, on screen. */
async function open(page: Page, name: string): Promise<void> {
  const end = [{ name, instance_id: 0 }];
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    body: JSON.stringify({
      graph_name: `just_${name}`,
      graph_entry: end,
      graph_exit: end,
      actions: [{ name, instance_id: 0, type: "sync" }],
    }),
    headers: { "content-type": "application/json" },
  });
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
}

test.beforeAll(async ({ browser }) => {
  writeFileSync(join(folder, "refuse.py"), "def run(action):\n    return False\n");
  await product.start();
  ada = await product.person(browser, "Ada");
});

test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
  rmSync(folder, { recursive: true });
});

test("the script is the default, and behaviours are a choice beside it", async () => {
  const { page } = ada;
  await open(page, "Refuse");
  const dialog = page.getByRole("dialog", { name: /^Start v1/ });
  await expect(dialog.getByRole("radio", { name: /^Simulated/ })).toBeChecked();
  await expect(dialog.getByRole("radio", { name: /^Python behaviours refuse$/ })).toBeVisible();
  await expect(dialog.getByRole("radio", { name: /^Simulator/ })).toHaveAccessibleName(
    "Simulator nothing moves",
  );
  await dialog.getByRole("radio", { name: /^Python behaviours/ }).check();
  await expect(dialog.getByRole("radio", { name: /^Simulator/ })).toHaveAccessibleName(
    "Simulator its Python code can move things",
  );
  const hold = dialog.getByRole("button", { name: "Run v1 in the simulator" });
  await expect(hold).toBeEnabled();
  await hold.focus();
  await page.keyboard.down("Enter");
  await expect(dialog).toBeHidden();
  await page.keyboard.up("Enter");
  await expect(card(page, "Refuse").getByText("false")).toBeVisible({ timeout: 15_000 });
});

test("one that cannot be run is said before the start, which is not offered then", async () => {
  const { page } = ada;
  writeFileSync(join(folder, "broken.py"), Buffer.from([0xff, 0xfe]));
  await open(page, "Broken");
  const dialog = page.getByRole("dialog", { name: /^Start v1/ });
  await dialog.getByRole("radio", { name: /^Python behaviours/ }).check();
  const looked = dialog.getByRole("region", { name: "Checks before the start" });
  await expect(looked.getByText("broken.py cannot be read: it is not UTF-8")).toBeVisible();
  await expect(dialog.getByRole("button", { name: /^Run v1: A check prevents/ })).toBeDisabled();
  await dialog.getByRole("radio", { name: /^Simulated/ }).check();
  await expect(dialog.getByRole("button", { name: "Run v1 in the simulator" })).toBeEnabled();
});
