/** Files of old dialects: what was translated is shown before anything is kept. */

import { expect, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const old = {
  graph_name: "old_patrol",
  umrf_actions: [
    {
      id: 0,
      name: "Look",
      suffix: 0,
      effect: "synchronous",
      input_parameters: {},
      children: [{ name: "Report", suffix: 0 }],
    },
    {
      id: 1,
      name: "Report",
      suffix: 0,
      effect: "synchronous",
      parents: [{ name: "Look", suffix: 0, required: "true" }],
    },
  ],
};

async function drop(page: Page, ...files: (readonly [name: string, text: string])[]) {
  const data = await page.evaluateHandle((given) => {
    const transfer = new DataTransfer();
    for (const [name = "", text = ""] of given) {
      transfer.items.add(new File([text], name, { type: "application/json" }));
    }
    return transfer;
  }, files);
  for (const kind of ["dragenter", "dragover", "drop"]) {
    await page.dispatchEvent("body", kind, { dataTransfer: data });
  }
}

const count = async () => (await product.ask<unknown[]>("/api/graphs")).length;

test("an old file is cancelled and leaves nothing, or kept and opens", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const before = await count();
  const dialog = page.getByRole("dialog");

  await drop(page, ["old.json", JSON.stringify(old)]);
  await expect(dialog).toContainText("old.json");
  await expect(
    dialog.getByRole("region", { name: "Translated" }).locator("li").first(),
  ).toBeVisible();
  expect(await count()).toBe(before);
  // Stop can be pressed while the dialog asks.
  await page.locator("button", { hasText: "Stop everything" }).click({ trial: true });
  await dialog.getByRole("button", { name: "Cancel", exact: true }).click();
  await expect(dialog).toBeHidden();
  expect(await count()).toBe(before);

  await drop(page, ["old.json", JSON.stringify(old)]);
  await dialog.getByRole("button", { name: "Keep" }).click();
  await page.waitForURL(/\/graphs\/.+/);
  await saved(page);
  await expect(card(page, "Look")).toBeVisible();
  await expect(card(page, "Report")).toBeVisible();
  expect(await count()).toBe(before + 1);
  expect(failures).toEqual([]);
  await context.close();
});

test("of two files dropped at once only the old one is asked about", async ({ browser }) => {
  const { page, context } = await product.person(browser, "Ada");
  const before = await count();
  const fresh = {
    graph_name: "fresh",
    graph_entry: [{ name: "Look", instance_id: 0 }],
    graph_exit: [{ name: "Look", instance_id: 0 }],
    actions: [{ name: "Look", instance_id: 0, type: "sync" }],
  };
  await drop(page, ["old.json", JSON.stringify(old)], ["fresh.json", JSON.stringify(fresh)]);
  await page.getByRole("dialog").getByRole("button", { name: "Cancel", exact: true }).click();
  await page.waitForURL(/\/graphs\/.+/);
  await expect(page).toHaveTitle(/fresh/);
  expect(await count()).toBe(before + 1);
  await context.close();
});
