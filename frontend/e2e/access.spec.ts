/** What checkers of accessibility find on every page, in both themes; reflow, motion, targets. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { expect, type Page, test } from "@playwright/test";
import type { AxeResults } from "axe-core";
import { card, saved, start } from "./canvas";
import { LONG, Product } from "./product";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** Everything that the checker finds, of any weight, with the place; or only what colours do. */
async function faults(page: Page, where: string, colors = false): Promise<string[]> {
  await page.evaluate(AXE); // by the debugger: the page itself may run nothing that is not its own
  const { violations } = await page.evaluate(
    (colors) =>
      Reflect.get(window, "axe").run(document, {
        ...(colors
          ? { runOnly: ["color-contrast", "link-in-text-block"] }
          : { rules: { "label-content-name-mismatch": { enabled: true } } }),
        resultTypes: ["violations"],
      }) as Promise<AxeResults>,
    colors,
  );
  return violations.flatMap(({ id, nodes }) =>
    nodes.slice(0, 4).map(({ target, failureSummary }) => {
      const why = (failureSummary ?? "").split("\n").slice(1, 2).join(" ");
      return `${where}: ${id} at ${target.join(" ")}: ${why}`;
    }),
  );
}

/** What opens over a page: by which button, and as what. */
type Opener = readonly [where: string, button: RegExp, role: "menu" | "dialog"];
const OVER_HOME: readonly Opener[] = [
  ["menu of a graph", /^More about fetch_tool/, "menu"],
  ["deleted graphs", /^Deleted graphs/, "dialog"],
  ["share", /^Share/, "dialog"],
  ["account", /^You are/, "dialog"],
];
const OVER_EDITOR: readonly Opener[] = [
  ["all commands", /^Everything you can do/, "menu"],
  ["start", /^Choose where to start/, "dialog"],
];
const BY_KEY = [
  ["shortcuts", "?"],
  ["palette", "ControlOrMeta+k"],
  ["arrow", "c"],
  ["add", "a"],
] as const;

type Look = (where: string) => Promise<void>;

async function opened(page: Page, look: Look, openers: readonly Opener[]): Promise<void> {
  for (const [where, button, role] of openers) {
    await page.getByRole("button", { name: button }).click();
    await expect(page.getByRole(role).last()).toBeVisible();
    await look(where);
    await page.keyboard.press("Escape");
    await expect(page.getByRole(role)).toHaveCount(0);
  }
}

/** The lists folded to a rail, with one of them over the canvas; and back. */
async function folded(page: Page, look: Look): Promise<void> {
  await page.getByRole("button", { name: "Fold the list" }).click();
  await look("rail");
  await page.getByRole("button", { name: "Outline", exact: true }).click();
  await expect(page.getByRole("treegrid")).toBeVisible();
  await look("list over the canvas");
  await page.getByRole("button", { name: "Unfold the list" }).click();
}

async function openedByKey(page: Page, look: Look): Promise<void> {
  for (const [where, key] of BY_KEY) {
    await page.keyboard.press(key);
    await expect(page.getByRole("dialog")).toBeVisible();
    await look(where);
    await page.keyboard.press("Escape");
    await expect(page.getByRole("dialog")).toHaveCount(0);
  }
}

async function graph(name: string): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  return `${product.url}/graphs/${graphs.find((each) => each.name === name)?.id}`;
}

for (const scheme of ["light", "dark"] as const) {
  test(`a checker finds nothing on any page, ${scheme}`, async ({ browser }) => {
    test.skip(scheme === "dark" && LONG !== "", LONG);
    test.setTimeout(180_000); // a score of places, each examined wholly
    const options = { colorScheme: scheme, reducedMotion: "reduce" as const };
    const { page, context } = await product.person(browser, "Ada", options);
    const found: string[] = [];
    // Both themes are built alike: what differs are colours.
    const look = async (where: string) => {
      found.push(...(await faults(page, where, scheme === "dark")));
    };
    await expect(page.getByRole("heading", { name: "valve_inspection" })).toBeVisible();
    await look("graphs");
    await opened(page, look, OVER_HOME);

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
    await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await folded(page, look);
    await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
    await openedByKey(page, look);
    await opened(page, look, OVER_EDITOR);
    await page.getByRole("button", { name: "Dry-run", exact: true }).click();
    await look("dry-run");
    await page.keyboard.press("d");

    if (scheme === "light") await start(page);
    else await page.goto(`${product.url}/runs`);
    if (scheme === "light") {
      await expect(page.locator('[data-tone="run"]').first()).toBeVisible();
      await look("running");
      await page.goto(`${product.url}/runs`);
    }
    await page.getByRole("main").waitFor();
    await look("runs");
    await page.getByRole("button", { name: "Filters" }).click();
    await expect(page.getByRole("dialog")).toBeVisible();
    await look("filters of runs");
    await page.keyboard.press("Escape");
    await page.goto(`${product.url}/robots`);
    await page.getByRole("main").waitFor();
    await look("robots");
    for (const path of ["/runs/statistics", "/runs/compare", "/nowhere"]) {
      await page.goto(product.url + path);
      // The bar comes with its screen, a moment after the place for it.
      await page.getByRole("heading", { level: 1 }).waitFor();
      await look(path);
    }
    const runs = await product.ask<{ id: string }[]>("/api/runs?limit=1", {}, product.runnerUrl);
    for (const { id } of runs) {
      await page.goto(`${product.url}/runs/${id}`);
      for (const tab of ["Parameters", "Facts", "Raw"]) {
        await page.getByRole("tab", { name: tab }).click();
        await look(`${tab} of a run`);
      }
      await page.goto(`${product.url}/runs/compare?a=${id}&b=${id}`);
      await page.getByRole("heading", { name: "Where they part" }).waitFor();
      await look("two runs");
    }
    await page.goto(`${product.url}/help/`);
    await look("help");
    expect([...new Set(found)]).toEqual([]);
    await context.close();
  });
}

test("at 320 px, which is a desktop at 400 %, nothing has to be scrolled sideways", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
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
    await expect(page.getByRole("button", { name: /^Stop / })).toBeInViewport({ ratio: 1 });
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
