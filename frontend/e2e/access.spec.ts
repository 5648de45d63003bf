/** What checkers of accessibility find on every page, in both themes; reflow, motion, targets. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { expect, type Page, test } from "@playwright/test";
import type { AxeResults } from "axe-core";
import { card, saved, start } from "./canvas";
import { Product } from "./product";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** What is serious or critical, with the place. */
async function faults(page: Page, where: string): Promise<string[]> {
  await page.evaluate(AXE); // by the debugger: the page itself may run nothing that is not its own
  const { violations } = await page.evaluate(
    () =>
      Reflect.get(window, "axe").run(document, {
        runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"],
        resultTypes: ["violations"],
        // An experiment of the checker: it counts what is hidden from names, as initials and states.
        rules: { "label-content-name-mismatch": { enabled: false } },
      }) as Promise<AxeResults>,
  );
  return violations
    .filter(({ impact }) => impact === "serious" || impact === "critical")
    .flatMap(({ id, nodes }) =>
      nodes.slice(0, 4).map(({ target, failureSummary }) => {
        const why = (failureSummary ?? "").split("\n").slice(1, 2).join(" ");
        return `${where}: ${id} at ${target.join(" ")}: ${why}`;
      }),
    );
}

async function graph(name: string): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  return `${product.url}/graphs/${graphs.find((each) => each.name === name)?.id}`;
}

for (const scheme of ["light", "dark"] as const) {
  test(`nothing serious on any page, ${scheme}`, async ({ browser }) => {
    const options = { colorScheme: scheme, reducedMotion: "reduce" as const };
    const { page, context } = await product.person(browser, "Ada", options);
    const found: string[] = [];
    const look = async (where: string) => found.push(...(await faults(page, where)));
    await expect(page.getByRole("heading", { name: "valve_inspection" })).toBeVisible();
    await look("graphs");

    await page.goto(await graph("valve_inspection"));
    await saved(page);
    await look("editor");
    await card(page, "CloseValve")
      .first()
      .click({ position: { x: 50, y: 30 } });
    await look("action");
    await page.keyboard.press("o");
    await look("outline");
    await page.keyboard.press("Enter");
    await page.getByRole("tab", { name: "JSON" }).click();
    await expect(page.getByRole("textbox", { name: "JSON of the graph" })).toBeVisible();
    await look("json");
    await page.getByRole("tab", { name: "Comments" }).click();
    await look("comments");
    await page.getByRole("tab", { name: "Problems" }).click();
    await look("problems");
    await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await page.keyboard.press("ControlOrMeta+f");
    await page.keyboard.type("valve");
    await look("find");
    await page.keyboard.press("Escape");

    if (scheme === "light") await start(page);
    else await page.goto(`${product.url}/runs`);
    if (scheme === "light") {
      await expect(page.locator('[data-tone="run"]').first()).toBeVisible();
      await look("running");
      await page.goto(`${product.url}/runs`);
    }
    await page.getByRole("main").waitFor();
    await look("runs");
    await page.goto(`${product.url}/robots`);
    await page.getByRole("main").waitFor();
    await look("robots");
    expect([...new Set(found)]).toEqual([]);
    await context.close();
  });
}

test("at 320 px, which is a desktop at 400 %, nothing has to be scrolled sideways", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada", {
    viewport: { width: 320, height: 640 },
  });
  for (const path of ["/", "/runs", "/robots", new URL(await graph("fetch_tool")).pathname]) {
    await page.goto(product.url + path);
    await page.getByRole("main").waitFor();
    await page.waitForLoadState("networkidle");
    const wide = await page.evaluate(() => {
      const { scrollWidth, clientWidth } = document.documentElement;
      return scrollWidth - clientWidth;
    });
    expect(wide, path).toBeLessThanOrEqual(0);
    expect(await faults(page, path)).toEqual([]);
  }
  await context.close();
});

test("the keyboard goes past the bar at once, sees where it is, and hears what others do", async ({
  browser,
}) => {
  const ada = await product.person(browser, "Ada");
  const mari = await product.person(browser, "Mari");
  const url = await graph("search_aisles");
  for (const { page } of [ada, mari]) {
    await page.goto(url);
    await saved(page);
  }
  await ada.page.keyboard.press("Tab");
  const skip = ada.page.getByRole("button", { name: "Skip to the content" });
  await expect(skip).toBeFocused();
  await expect(skip).toBeInViewport();
  await ada.page.keyboard.press("Enter");
  await expect(ada.page.getByRole("main")).toBeFocused();
  await ada.page.keyboard.press("Tab");
  const ring = await ada.page.evaluate(() => {
    const style = getComputedStyle(document.activeElement ?? document.body);
    return style.outlineStyle !== "none" || style.boxShadow !== "none";
  });
  expect(ring).toBe(true);

  const name = mari.page.getByRole("textbox", { name: "Graph", exact: true });
  await name.fill("other_name");
  await name.press("Enter");
  await mari.page.keyboard.press("Escape");
  await mari.page.getByRole("button", { name: "Undo" }).click();
  await mari.page
    .locator(".react-flow__node-action")
    .first()
    .click({ position: { x: 50, y: 30 } });
  const robot = mari.page.getByRole("combobox", { name: "Robot" });
  await robot.fill("rover");
  await robot.press("Tab");
  const heard = ada.page.getByRole("status", { name: "What happens" });
  await expect(heard).toContainText(/Mari changed/);
  await ada.context.close();
  await mari.context.close();
});
