/** Files of old dialects: what was translated is shown before anything is kept. */

import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
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

/**
 * Drops what lies on the disk, as a hand does: by the browser's own drag and drop, since only of such
 * a drop the page gets folders. A DataTransfer that a script makes holds files alone, and the page's
 * field takes no folder.
 */
async function dropFromDisk(page: Page, ...paths: string[]): Promise<void> {
  const hand = await page.context().newCDPSession(page);
  const data = { items: [], files: paths, dragOperationsMask: 1 };
  for (const type of ["dragEnter", "dragOver", "drop"] as const) {
    await hand.send("Input.dispatchDragEvent", { type, x: 700, y: 400, data });
  }
  await hand.detach();
}

test("a folder dropped on the page of actions brings all that lie in it, however deep", async ({
  browser,
}) => {
  const folder = mkdtempSync(join(tmpdir(), "dropped-"));
  const file = (path: string, body: object | string) => {
    mkdirSync(dirname(join(folder, path)), { recursive: true });
    writeFileSync(join(folder, path), typeof body === "string" ? body : JSON.stringify(body));
  };
  const action = (name: string) => ({ name, type: "sync", input_parameters: {} });
  file("src/open_door/open_door.umrf.json", action("OpenDoor"));
  file("src/open_door/package.json", action("NoFileOfAnAction"));
  file("src/doors/shut/deep/shut_door.umrf.json", action("ShutDoor"));
  // More than a folder is read of at a time.
  for (let i = 0; i < 120; i += 1) file(`src/many/m${i}.umrf.json`, action(`Many${i}`));
  file("src/doors/broken.umrf.json", "{");
  try {
    const { page, context, failures } = await product.person(browser, "Ada");
    await page.goto(`${product.url}/actions`);
    const list = page.getByRole("navigation", { name: "Actions" });
    await expect(list).toBeVisible();
    await dropFromDisk(page, join(folder, "src"));
    // One after the other, with progress: on a busy machine that is an eighth of a second each.
    await expect(page.getByText(/^123 of 123|broken\.umrf\.json/).first()).toBeVisible({
      timeout: 60_000,
    });
    for (const name of ["OpenDoor", "ShutDoor", "Many0", "Many119"]) {
      await expect(list.getByRole("link", { name: new RegExp(`^${name}\\b`) })).toBeVisible();
    }
    await expect(page.getByText(/broken\.umrf\.json/)).toBeVisible();
    const known = await product.ask<{ name: string; document: string | null }[]>("/api/actions");
    expect(known.filter(({ name, document }) => document && /^Many/.test(name))).toHaveLength(120);
    expect(known.map(({ name }) => name)).not.toContain("NoFileOfAnAction");
    expect(failures).toEqual([]);
    await context.close();
  } finally {
    rmSync(folder, { recursive: true });
  }
});
