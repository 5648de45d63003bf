/** Expected courses in the page: kept of a dry-run, told when the graph goes another way, tests that cover more. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { expect, type Page, test } from "@playwright/test";
import type { AxeResults } from "axe-core";
import { card } from "./canvas";
import { LONG, type Person, Product } from "./product";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const product = new Product();
let ada: Person;

test.skip(LONG !== "", LONG);
test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

const panelOf = (page: Page) => page.getByRole("tabpanel", { name: "Expected courses" });

/** A dry-run in which all goes well, kept under a name. */
async function keepDryRun(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Dry-run", exact: true }).click();
  const bar = page.getByRole("region", { name: "Dry-run" });
  await bar.getByRole("button", { name: "Expect this course …" }).click();
  await bar.getByRole("textbox", { name: "Name of the expected course" }).fill(name);
  await bar.getByRole("button", { name: "Expect this" }).click();
  await expect(panelOf(page).getByText(name)).toBeVisible();
  await bar.getByRole("button", { name: "Close the dry-run" }).click();
}

test("a dry-run is kept, what it leaves out is marked, and a test that is found covers it", async () => {
  const { page } = ada;
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await expect(card(page, "Wait", 2)).toBeVisible();
  await keepDryRun(page, "all goes well");
  const panel = panelOf(page);
  const course = panel.locator('[data-course="all goes well"]');
  await expect(course).toHaveAttribute("data-verdict", "same");
  const covered = panel.getByText(/^\d+ of \d+ outcomes of arrows are taken$/);
  const before = (await covered.textContent()) ?? "";
  const untaken = panel.getByRole("list", { name: "Never taken" }).getByRole("listitem");
  const first = untaken.first();
  const place = (await first.getAttribute("data-untaken")) ?? "";
  await expect(
    page.locator(".react-flow__edgelabel-renderer").getByText("never taken"),
  ).not.toHaveCount(0);
  await page.evaluate(AXE);
  const found = await page.evaluate(
    () => Reflect.get(window, "axe").run("[data-courses]") as Promise<AxeResults>,
  );
  expect(found.violations.map(({ id: rule, nodes }) => [rule, nodes[0]?.html])).toEqual([]);

  await first.getByRole("button", { name: /^Find a test/ }).click();
  await expect(first.getByText("A test was found.")).toBeVisible();
  await first.getByRole("button", { name: "Keep it …" }).click();
  await first.getByRole("button", { name: "Expect this" }).click();
  await expect(panel.locator(`[data-untaken="${place}"]`)).toHaveCount(0);
  await expect(covered).not.toHaveText(before);
  await expect(panel.locator("[data-course]")).toHaveCount(2);
  await expect(panel.locator('[data-course]:not([data-verdict="same"])')).toHaveCount(0);
});

test("an edit that goes another way is told in the panel and before a start, and taking it back mends it", async () => {
  const { page } = ada;
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await expect(card(page, "Wait", 2)).toBeVisible();
  await keepDryRun(page, "to the end");
  const course = panelOf(page).locator('[data-course="to the end"]');
  await card(page, "Wait", 1).click();
  await page.keyboard.press("ControlOrMeta+Delete");
  await page.getByRole("tab", { name: "Expected courses" }).click();
  await expect(course).toHaveAttribute("data-verdict", "other");
  await expect(course).toContainText(/^.*Step \d+: expected Wait_1 is told to run/);
  await page.getByRole("button", { name: "Choose where to start", exact: false }).first().click();
  await expect(
    page.getByText("It does not go as expected, in 1 of 1 expected course.", { exact: false }),
  ).toBeVisible();
  await page.keyboard.press("Escape");
  await page.getByRole("radiogroup", { name: "What is listed" }).getByText("History").click();
  const history = page.getByRole("region", { name: "History" });
  await history.getByText(/^Versions/).click();
  await history.getByRole("button", { name: "Publish a version …" }).click();
  await history.getByRole("button", { name: "Publish", exact: true }).click();
  await expect(history.getByText("1 of 1 expected courses goes another way:")).toBeVisible();
  await page.getByRole("tab", { name: "Expected courses" }).focus();
  await page.keyboard.press("Control+z");
  await expect(course).toHaveAttribute("data-verdict", "same");
  await course.getByRole("button", { name: "Play to the end on the canvas" }).click();
  await expect(page.getByRole("region", { name: "Dry-run" })).toBeVisible();
  await page.getByRole("button", { name: "Close the dry-run" }).click();
  await course.getByRole("button", { name: "Expect to the end no more" }).click();
  await expect(panelOf(page).locator("[data-course]")).toHaveCount(0);
});
