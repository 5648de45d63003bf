/** The pictures in docs/pictures, taken by `make pictures` from the running product. */

import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, saved, start } from "./bench";
import { Product } from "./product";

test.skip(process.env.PICTURES !== "1", "takes pictures for the documentation: make pictures");

const FOLDER = resolve(import.meta.dirname, "../../docs/pictures");
const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

async function picture(page: Page, name: string): Promise<void> {
  await page.screenshot({ path: resolve(FOLDER, `${name}.png`) });
}

async function graph(name: string): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  const found = graphs.find((each) => each.name === name);
  if (found === undefined) throw new Error(`no example ${name}`);
  return `${product.url}/graphs/${found.id}`;
}

for (const scheme of ["light", "dark"] as const) {
  test(`desktop, ${scheme}`, async ({ browser }) => {
    const options = { colorScheme: scheme, viewport: { width: 1440, height: 900 } };
    const { page, context } = await product.person(browser, "Ada", options);
    const mari = await product.person(browser, "Mari", options);
    await picture(page, `graphs-${scheme}`);
    const url = await graph("prepare_delivery");
    await page.goto(url);
    await mari.page.goto(url);
    await saved(page);
    await card(mari.page, "DriveTo")
      .first()
      .click({ position: { x: 50, y: 30 } });
    await start(page);
    await card(page, "DriveTo")
      .first()
      .click({ position: { x: 50, y: 30 } });
    await expect(page.locator('[data-tone="run"]').first()).toBeVisible();
    await page.waitForTimeout(1300);
    await picture(page, `editor-${scheme}`);
    await expect(page.getByText("finished", { exact: true }).first()).toBeVisible({
      timeout: 20_000,
    });
    await page.getByText("Open run").click();
    await expect(page.getByText("Run finished").first()).toBeVisible();
    await page.waitForTimeout(800);
    await picture(page, `run-${scheme}`);
    await page.goto(`${product.url}/runs`);
    await page.waitForTimeout(800);
    await picture(page, `runs-${scheme}`);
    await context.close();
    await mari.context.close();
  });
}

for (const [name, width, height] of [
  ["tablet", 768, 1024],
  ["phone", 390, 844],
] as const) {
  test(`on a ${name}`, async ({ browser }) => {
    const options = { viewport: { width, height }, hasTouch: true, isMobile: true };
    const { page, context } = await product.person(browser, "Ada", options);
    await page.goto(await graph("valve_inspection"));
    await saved(page);
    await page.waitForTimeout(800);
    await picture(page, `editor-${name}`);
    await context.close();
  });
}
