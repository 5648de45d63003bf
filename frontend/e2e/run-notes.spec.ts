/** Notes at moments of a run, by keys and on a phone; and pages of runs at 360 px. */

import { expect, type Page, test } from "@playwright/test";
import { type Person, Product } from "./product";
import { post, ran, VALVES, violations } from "./valves";

const product = new Product();
let ada: Person;
let graph: string;
let run: { id: string; number: number };

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
  graph = (await post<{ id: string }>(product, "/api/graphs", VALVES)).id;
  run = await ran(product, graph);
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

const events = (page: Page) => page.getByRole("complementary", { name: "About the run" });

test("by keys a note stands at the moment that is shown, on the axis, in events and in the search", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${run.id}?t=100`);
  await page.getByRole("textbox", { name: "Search events" }).focus();
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await expect(page.getByRole("textbox", { name: "Note at 0:00" })).toBeFocused();
  await page.keyboard.type("the hinge squeaks");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  const line = events(page).getByRole("listitem").filter({ hasText: "Ada noted" });
  await expect(line).toContainText("“the hinge squeaks”");
  await expect(line).toContainText("+0.1");
  await expect(page.getByTitle("Ada noted: “the hinge squeaks”")).toHaveCount(1);
  await page.getByRole("textbox", { name: "Search events" }).fill("hinge");
  await expect(events(page).getByRole("listitem")).toHaveCount(1);
  await page.goto(`${product.url}/runs?text=squeaks`);
  await expect(page.getByText(`Run ${run.number}`, { exact: false }).first()).toBeVisible();
});

test("at 360 px a finger writes a note, and no page of runs goes beyond the screen", async ({
  browser,
}) => {
  const { page, failures } = await product.person(browser, "Mari", {
    viewport: { width: 360, height: 740 },
    hasTouch: true,
    isMobile: true,
  });
  await page.goto(`${product.url}/runs/${run.id}`);
  await page.getByRole("button", { name: "Note", exact: true }).tap();
  await page.getByRole("textbox", { name: "Note at the end" }).fill("it stood crooked");
  expect(await violations(page)).toEqual([]);
  await page.getByRole("button", { name: "Save note" }).tap();
  await expect(events(page).getByText("“it stood crooked”")).toBeVisible();
  for (const path of [`/runs/${run.id}`, "/runs", `/runs/statistics?graph=${graph}`]) {
    await page.goto(product.url + path);
    await page.waitForLoadState("networkidle");
    const beyond = await page.evaluate(() =>
      [...document.querySelectorAll<HTMLElement>("main *")]
        .filter((each) => !each.closest(".react-flow") && each.checkVisibility())
        .filter((each) => each.getBoundingClientRect().right > window.innerWidth + 1)
        .map((each) => each.outerHTML.slice(0, 80)),
    );
    expect([path, beyond]).toEqual([path, []]);
  }
  expect(failures).toEqual([]);
});
