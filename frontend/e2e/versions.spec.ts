/** Versions with what ran of them, two moments side by side, and what broke a graph found and taken back. */

import { expect, type Page, test } from "@playwright/test";
import { boxOf, card, saved, start, umrfOf } from "./canvas";
import { type Person, Product } from "./product";
import { begun, choose, post, ran, setSpeed, VALVES, violations } from "./valves";

const product = new Product();
let ada: Person;
let mari: Person;
let graph: string;

test.describe.configure({ mode: "serial" });
test.beforeAll(async ({ browser }) => {
  await product.start();
  graph = (await post<{ id: string }>(product, "/api/graphs", VALVES)).id;
  ada = await product.person(browser, "Ada");
  mari = await product.person(browser, "Mari");
  for (const { page } of [ada, mari]) await page.goto(`${product.url}/graphs/${graph}`);
});
test.afterAll(async () => {
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await product.dispose();
});

const panel = (page: Page) => page.getByRole("region", { name: "History" });
const bar = (page: Page) => page.getByRole("region", { name: "The past" });
const versions = (page: Page) =>
  panel(page).getByRole("list", { name: "Versions" }).locator("> li");
const compared = (page: Page) => bar(page).getByRole("combobox", { name: "Compare with" });

async function openHistory(page: Page, view: "History" | "Versions"): Promise<void> {
  await page.getByRole("radiogroup", { name: "What is listed" }).getByText("History").click();
  await page.getByRole("radiogroup", { name: "What of the history" }).getByText(view).click();
}

test("a version is published with a name and a note, and says what ran of it", async () => {
  const { page } = ada;
  await setSpeed(page, "0.9");
  await openHistory(page, "Versions");
  await expect(panel(page)).toContainText("No version yet.");
  await page.getByRole("button", { name: "Publish a version" }).click();
  await page.getByRole("textbox", { name: "Name" }).fill("before the steam leak");
  await page.getByRole("textbox", { name: "Note" }).fill("Gentler at the seal.");
  expect(await violations(page)).toEqual([]);
  await page.getByRole("button", { name: "Publish", exact: true }).click();
  const first = versions(page).first();
  await expect(first).toContainText("v1");
  await expect(first).toContainText("before the steam leak");
  await expect(first).toContainText("Gentler at the seal.");
  await expect(first).toContainText(/Ada · .*[0-9a-f]{8}/);
  await expect(first).toContainText("No run yet");
  for (const _ of [1, 2]) await ran(product, graph);
  await expect(first).toContainText("2 runs: 2 finished");
  await expect(first.getByRole("link", { name: /Run 2/ })).toHaveAttribute("href", /runs/);
});

test("a version is looked at by its address, and becomes a graph of its own", async () => {
  const { page } = ada;
  await versions(page)
    .first()
    .getByRole("button", { name: /before the steam leak/ })
    .click();
  await expect(bar(page)).toBeVisible();
  await expect(page).toHaveURL(/at=\d+&with=good/);
  await expect(page.getByRole("button", { name: "Copy link" })).toBeVisible();
  expect(await violations(page)).toEqual([]);
  await versions(page).getByRole("button", { name: "Copy v1 as a new graph" }).click();
  const opened = page.getByRole("link", { name: "Open valves v1" });
  await expect(opened).toBeVisible();
  const [, id = ""] = /graphs\/([^/?]+)/.exec((await opened.getAttribute("href")) ?? "") ?? [];
  const { actions } = await umrfOf(product, id);
  expect(actions.map(({ name }) => name).sort()).toEqual(["Cool", "Drive", "Report"]);
  await bar(page).getByRole("button", { name: "Back to now" }).click();
});

test("what changed since the last good run is marked quietly, until one does not want it", async () => {
  const { page } = ada;
  await setSpeed(mari.page, "1.5");
  const mark = card(page, "Drive").locator("[data-since=changed]");
  await expect(mark).toBeVisible();
  await expect(card(page, "Cool").locator("[data-since]")).toHaveCount(0);
  await mark.hover();
  await expect(page.getByRole("tooltip")).toContainText(
    "Mari changed speed 0.9 → 1.5 since run 2, which went well",
  );
  await openHistory(page, "History");
  await page.getByRole("checkbox", { name: "Mark it on the canvas" }).uncheck();
  await expect(mark).toHaveCount(0);
  await page.reload();
  await expect(card(page, "Drive")).toBeVisible();
  await openHistory(page, "History");
  const wanted = page.getByRole("checkbox", { name: "Mark it on the canvas" });
  await expect(wanted).not.toBeChecked();
  await expect(mark).toHaveCount(0);
  await wanted.check();
  await expect(mark).toBeVisible();
});

test("a value is set back from the chart of all that it was", async () => {
  const { page } = ada;
  await choose(page, "Drive");
  const fields = page.getByRole("list", { name: "Who set what" }).locator("> li");
  const speed = fields.filter({ hasText: "speed" });
  await speed.getByRole("button").first().click();
  const table = speed.getByRole("table", { name: "Values of speed" });
  const rows = table.getByRole("row");
  await expect(rows.nth(1)).toContainText(/1\.5.*Mari/);
  await expect(rows.nth(2)).toContainText(/0\.9.*Ada.*runs 1–2/);
  await expect(rows.nth(3)).toContainText("0.4");
  await expect(speed.getByRole("list", { name: /Runs with each value/ })).toContainText(
    /With 0\.9: 2 runs, 2 true/,
  );
  expect(await violations(page)).toEqual([]);
  await speed.getByRole("button", { name: "Set speed back to 0.9" }).click();
  for (const each of [page, mari.page]) await expect(card(each, "Drive")).toContainText("0.9");
  await saved(page);
  await expect(card(page, "Drive").locator("[data-since]")).toHaveCount(0);
  await page.keyboard.press("ControlOrMeta+z");
  await expect(card(page, "Drive")).toContainText("1.5");
  await page.keyboard.press("Escape");
});

test("two moments stand side by side, with one view, and are walked by keys", async () => {
  const { page } = ada;
  await choose(mari.page, "Cool");
  await mari.page.keyboard.press("Delete");
  await saved(mari.page);
  await expect(card(page, "Cool")).toHaveCount(0);
  await openHistory(page, "Versions");
  await versions(page)
    .first()
    .getByRole("button", { name: /before the steam leak/ })
    .click();
  await page.getByRole("button", { name: "Compare with now" }).click();
  await bar(page).getByText("Side by side").click();
  const earlier = page.getByRole("region", { name: "Earlier" });
  await expect(earlier.locator("[data-name=Cool][data-change=removed]")).toBeVisible();
  await expect(earlier.locator("[data-name=Drive][data-change=changed]")).toContainText("0.9");
  const later = page.getByRole("application", { name: "Canvas", exact: true });
  await expect(later.locator("[data-name=Drive][data-change=changed]")).toContainText("1.5");
  await expect(later.locator("[data-name=Cool]")).toHaveCount(0);
  expect(await violations(page)).toEqual([]);
  const view = (of: typeof later) =>
    of.locator(".react-flow__viewport").evaluate((sheet) => (sheet as HTMLElement).style.transform);
  await page.keyboard.press("n");
  await expect(bar(page).getByRole("status")).toContainText("1 of 4 · Drive");
  await page.keyboard.press("n");
  await expect(bar(page).getByRole("status")).toContainText("2 of 4 · Cool removed");
  await page.keyboard.press("p");
  await expect(bar(page).getByRole("status")).toContainText("1 of 4");
  await earlier.locator("[data-name=Cool]").hover();
  await page.mouse.wheel(0, 240);
  await expect.poll(async () => (await view(earlier)) === (await view(later))).toBe(true);
  await page.mouse.move(700, 300);
  await page.setViewportSize({ width: 390, height: 844 });
  const overlap = async () => {
    const [above, below] = [await boxOf(earlier), await boxOf(later)];
    return above.y + above.height - below.y;
  };
  await expect.poll(overlap).toBeLessThanOrEqual(3); // once both are laid out anew
  expect(await violations(page)).toEqual([]);
  await page.setViewportSize({ width: 1280, height: 800 });
  await bar(page).getByText("One canvas").click();
  await expect(earlier).toHaveCount(0);
  await bar(page).getByRole("button", { name: "Back to now" }).click();
});

test("a moment is compared with what runs now, also where that is no version of the graph", async () => {
  const { page } = ada;
  const slow = await begun(product, graph, 60);
  await setSpeed(mari.page, "2");
  await openHistory(page, "History");
  await page.getByRole("button", { name: "What changed since run 2" }).click();
  await compared(page).selectOption({
    label: `what runs on simulator now: run ${slow.number}, v2`,
  });
  await expect(card(page, "Drive").locator("[data-change]").first()).toBeVisible();
  await expect(bar(page).getByRole("list", { name: "What differs" })).toHaveText(/1\s*card/);
  const stop = { stop_id: "e2e-versions" };
  await post(product, `/api/runs/${slow.id}/stop`, stop, product.runnerUrl);
  await bar(page).getByRole("button", { name: "Back to now" }).click();

  const other = { ...VALVES, graph_description: "from elsewhere" };
  const { id } = await post<{ id: string }>(product, "/api/graphs", other);
  const foreign = await begun(product, id, 60, graph);
  await page.getByRole("button", { name: "What changed since run 2" }).click();
  await compared(page).selectOption(`run/${foreign.id}`);
  await expect(bar(page)).toContainText("What runs is no version of this graph");
  await expect(page).toHaveURL(/with=run/);
  // Known by their names, what is drawn here and there is compared.
  await expect(bar(page).getByRole("list", { name: "What differs" })).toContainText("1 card");
  await expect(card(page, "Cool").locator("[data-change=removed]").first()).toBeVisible();
  await post(product, `/api/runs/${foreign.id}/stop`, stop, product.runnerUrl);
  await bar(page).getByRole("button", { name: "Back to now" }).click();
});

test("two people and a run in between: who broke it is found, it is restored, and runs again", async () => {
  const { page } = ada;
  const failed = await ran(product, graph);
  expect(failed.state).toBe("halted");
  await openHistory(page, "History");
  await page.getByRole("button", { name: "What changed since run 2, which went well" }).click();
  const gone = card(page, "Cool").locator("[data-change=removed]").first();
  await expect(gone).toContainText("Mari");
  await openHistory(page, "Versions");
  const good = versions(page).filter({ hasText: "before the steam leak" });
  await expect(versions(page).first()).toContainText(/Run \d+\s*halted/);
  await good.getByRole("button", { name: /before the steam leak/ }).click();
  await good.getByRole("button", { name: /^Restore v/ }).click();
  await expect(bar(page)).toHaveCount(0);
  for (const each of [page, mari.page]) await expect(card(each, "Cool")).toBeVisible();
  expect(JSON.stringify(await umrfOf(product, graph))).toContain('"pvf_value":0.9');
  await start(page);
  await openHistory(page, "Versions");
  await expect(versions(page).first()).toContainText(/Run \d+\s*finished/, { timeout: 30_000 });
  await openHistory(page, "History");
  await expect(panel(page)).toContainText("restored it");
});
