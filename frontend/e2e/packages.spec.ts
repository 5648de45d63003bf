/** C++ packages in the page: what is in them, why some actions have none, and a file of all. */

import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, chosen, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const leaf = (kind: string) => ({ pvf_type: kind });
const action = (name: string, instance: number, input_parameters: object) => ({
  ...{ name, instance_id: instance, type: "sync", input_parameters },
  gui_attributes: { position: { x: instance * 300, y: name.length * 90 } },
});

/** Two that can be, one whose name C++ has taken, one that differs from itself. */
async function kitchen(): Promise<string> {
  const body = JSON.stringify({
    graph_name: "kitchen",
    graph_entry: [],
    graph_exit: [],
    actions: [
      action("OpenLid", 0, { pose: { x: leaf("number"), y: leaf("number") } }),
      action("Drive", 0, { speed: leaf("number") }),
      action("Drive", 1, { speed: leaf("number") }),
      action("class", 0, {}),
      action("Look", 0, { at: leaf("string") }),
      action("Look", 1, { at: leaf("number") }),
    ],
  });
  const headers = { "content-type": "application/json" };
  return (await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers })).id;
}

/** What was downloaded, unpacked. */
async function unpacked(page: Page, press: () => Promise<void>): Promise<string> {
  const download = page.waitForEvent("download");
  await press();
  const file = await (await download).path();
  const folder = mkdtempSync(join(tmpdir(), "packages-"));
  execFileSync("python3", ["-m", "zipfile", "-e", file, folder]);
  return folder;
}

test("the packages of a graph are looked at, downloaded, and what has none is shown", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await kitchen()}`);
  await saved(page);
  await page.keyboard.press("ControlOrMeta+k");
  await page.keyboard.type("c++ packages");
  await page.keyboard.press("Enter");
  const dialog = page.getByRole("dialog", { name: "C++ packages" });
  await expect(dialog.getByRole("region", { name: "open_lid/src/open_lid.cpp" })).toContainText(
    "onRun",
  );
  await dialog.getByRole("button", { name: /input_parameters\.hpp$/ }).click();
  const shown = dialog.locator("pre");
  await expect(shown).toContainText("double");

  const folder = await unpacked(page, () =>
    dialog.getByRole("link", { name: "Download all 2" }).click(),
  );
  const header = readFileSync(join(folder, "open_lid/include/open_lid/input_parameters.hpp"));
  expect(header.toString()).toBe(await shown.textContent());
  expect(readFileSync(join(folder, "drive/drive.umrf.json")).toString()).toContain("speed");

  const against = dialog.getByRole("region", { name: "Without a package" });
  await expect(against.getByRole("listitem")).toHaveCount(2);
  await expect(against).toContainText("a word of C++");
  await against.getByRole("button", { name: "Show Look" }).click();
  await expect(dialog).toHaveCount(0);
  await expect(chosen(page)).toHaveCount(2);
  await expect(card(page, "Look", 1)).toBeInViewport();
  expect(failures).toEqual([]);
  await context.close();
});

test("an action leads to its own package, by its form and by the menu of its card", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await kitchen()}`);
  await saved(page);
  await card(page, "Drive", 1).click();
  await page.getByRole("button", { name: "C++ package", exact: true }).click();
  const dialog = page.getByRole("dialog", { name: "C++ packages" });
  await expect(dialog.getByRole("region", { name: "drive/src/drive.cpp" })).toBeVisible();
  const folder = await unpacked(page, () =>
    dialog.getByRole("link", { name: "Download drive", exact: true }).click(),
  );
  expect(() => readFileSync(join(folder, "open_lid/package.xml"))).toThrow();
  expect(readFileSync(join(folder, "drive/package.xml")).toString()).toContain("<name>drive<");
  await page.keyboard.press("Escape");
  await expect(dialog).toHaveCount(0);

  await card(page, "OpenLid").click({ button: "right" });
  await page.getByRole("menuitem", { name: "C++ packages" }).click();
  await expect(dialog.getByRole("region", { name: "open_lid/src/open_lid.cpp" })).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});
