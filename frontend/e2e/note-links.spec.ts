/** Links from notes to actions: offered while they are written, by keys, by mouse and by touch. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { expect, type Page, test } from "@playwright/test";
import type { AxeResults } from "axe-core";
import { saved } from "./canvas";
import { LONG, Product } from "./product";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

async function opened(page: Page): Promise<string> {
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await page.getByRole("button", { name: "Write a note" }).click();
  return id;
}

const list = (page: Page) => page.getByRole("listbox", { name: "Actions to link to" });

for (const scheme of ["light", "dark"] as const) {
  test(`by keys: [[ offers the names of actions, Escape closes only the list, ${scheme}`, async ({
    browser,
  }) => {
    test.skip(scheme === "dark" && LONG !== "", LONG);
    const { page, context, failures } = await product.person(browser, "Ada", {
      colorScheme: scheme,
    });
    const id = await opened(page);
    const text = page.getByRole("textbox", { name: "Text of the note" });
    await expect(text).toBeFocused();
    await page.keyboard.type("First [");
    await expect(list(page)).toHaveCount(0);
    await page.keyboard.type("[");
    await expect(list(page).getByRole("option")).toHaveText(["Wait 0", "Wait 1", "Wait 2"]);
    await page.evaluate(AXE);
    const { violations } = await page.evaluate(
      () => Reflect.get(window, "axe").run(document) as Promise<AxeResults>,
    );
    expect(violations.map(({ id, nodes }) => [id, nodes.map(({ target }) => target)])).toEqual([]);
    await expect(list(page).getByRole("option", { selected: true })).toHaveText("Wait 0");
    await page.keyboard.press("Escape");
    await expect(list(page)).toHaveCount(0);
    await expect(text).toBeFocused();

    await page.keyboard.type("w");
    await page.keyboard.press("ArrowDown");
    await expect(list(page).getByRole("option", { selected: true })).toHaveText("Wait 1");
    const chosen = await text.getAttribute("aria-activedescendant");
    await expect(page.locator(`[id="${chosen}"]`)).toHaveText("Wait 1");
    await page.keyboard.press("Enter");
    await expect(text).toHaveValue("First [[Wait 1]]");
    await page.keyboard.type(" then [[2");
    await page.keyboard.press("Tab");
    await expect(text).toHaveValue("First [[Wait 1]] then [[Wait 2]]");
    await page.keyboard.press("Escape"); // with no list, it ends the note as before
    await expect(text).toHaveCount(0);
    await expect(page.getByRole("button", { name: "Wait 2" }).last()).toBeVisible();
    await saved(page);
    const umrf = JSON.stringify(await product.ask(`/api/graphs/${id}/umrf`));
    expect(umrf).toMatch(/First \[\[Wait 1#\w{12}\]\] then \[\[Wait 2#\w{12}\]\]/);
    expect(failures).toEqual([]);
    await context.close();
  });
}

test("by mouse on the canvas and in the details, by a finger too", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", { hasTouch: true });
  await opened(page);
  const text = page.getByRole("textbox", { name: "Text of the note" });
  await expect(text).toBeFocused();
  await page.keyboard.type("see [[");
  await list(page).getByRole("option", { name: "Wait 1" }).click();
  await expect(text).toHaveValue("see [[Wait 1]]");
  await expect(text).toBeFocused();
  await page.keyboard.type(" [[");
  await list(page).getByRole("option", { name: "Wait 2" }).tap();
  await expect(text).toHaveValue("see [[Wait 1]] [[Wait 2]]");
  await expect(text).toBeFocused();
  await page.keyboard.press("Escape");

  const field = page.getByRole("textbox", { name: "Text", exact: true });
  await field.click();
  await field.press("ControlOrMeta+End");
  await page.keyboard.type(" or [[0");
  await page.keyboard.press("Escape"); // the draft stays
  await expect(field).toHaveValue(/ or \[\[0$/);
  await page.keyboard.type(" ");
  await page.keyboard.press("Enter");
  await expect(field).toHaveValue(/ or \[\[Wait 0\]\]$/);
  await page.keyboard.press("Tab");
  await saved(page);
  await expect(page.getByRole("group", { name: /Note.*Wait 0/ })).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});
