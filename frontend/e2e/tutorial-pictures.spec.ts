/** Does what docs/tutorial.md says, step by step, and takes its pictures: `make pictures`. */

import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { arrows, atRest, card, fitView, holdEnter, saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { Product } from "./product";

test.skip(process.env.PICTURES !== "1", "takes pictures for the documentation: make pictures");
test.describe.configure({ mode: "serial" });

const FOLDER = resolve(
  process.env.PICTURES_TO ?? resolve(import.meta.dirname, "../../docs/pictures"),
);
const SIZE = { viewport: { width: 1280, height: 800 }, panels: "folded" } as const; // as at first
const product = new Product();
const david = new StandIn("David");
let graph = "";

test.beforeAll(() => product.start());
test.afterAll(async () => {
  await david.kill();
  await product.dispose();
});

async function picture(page: Page, name: string): Promise<void> {
  await page.mouse.move(1, 400); // no hint of a button
  await atRest(page);
  await page.screenshot({ path: resolve(FOLDER, `tutorial-${name}.png`) });
}

async function follows(page: Page, outcome: string, name: string): Promise<void> {
  await page.keyboard.press("c");
  await expect(page.getByRole("radiogroup", { name: "Outcome" })).toBeVisible();
  await page.keyboard.press(outcome);
  await page.keyboard.type(name);
  await page.keyboard.press("Enter");
}

async function chosen(page: Page, name: string): Promise<void> {
  await card(page, name).click({ position: { x: 50, y: 30 } });
  await expect(page.locator(".react-flow__node.selected")).toContainText(name);
}

async function holdNamed(page: Page, name: RegExp): Promise<void> {
  const button = page.getByRole("button", { name });
  await expect(button).toBeEnabled({ timeout: 45_000 });
  await holdEnter(page, button);
}

test("start it, and draw", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", SIZE);
  await expect(page.getByRole("heading", { name: "valve_inspection" })).toBeVisible();
  await picture(page, "first-page");

  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  graph = page.url().split("/").at(-1) ?? "";
  await saved(page);
  await page.getByRole("heading", { level: 1 }).getByRole("button").click();
  const name = page.getByRole("textbox", { name: "Name of the graph" });
  await name.fill("water_plant");
  await name.press("Enter");
  await page.locator(".react-flow__pane").click({ position: { x: 300, y: 500 } });
  await page.keyboard.press("a");
  await page.keyboard.type("GoToPlant");
  await page.keyboard.press("Enter");
  await expect(card(page, "GoToPlant")).toBeVisible();
  await follows(page, "1", "IsDry");
  await chosen(page, "IsDry");
  await follows(page, "1", "Water");
  await chosen(page, "Water");
  await page.keyboard.press("x");
  await expect.poll(() => arrows(product, graph)).toContain("Water_0 > exit");
  await chosen(page, "IsDry");
  await follows(page, "2", "exit");
  await saved(page);
  await expect
    .poll(() => arrows(product, graph))
    .toEqual([
      "GoToPlant_0 > IsDry_0",
      "IsDry_0 > Water_0",
      "IsDry_0 > exit",
      "Water_0 > exit",
      "entry > GoToPlant_0",
    ]);
  await page.reload();
  await saved(page);
  await fitView(page);
  await picture(page, "graph");
  expect(failures).toEqual([]);
  await context.close();
});

test("try it, run it and stop it in the simulator", async ({ browser }) => {
  const { page, context } = await product.person(browser, "Ada", SIZE);
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Dry-run" }).click();
  const bar = page.getByRole("region", { name: "Dry-run" });
  await bar.getByRole("button", { name: /^true/ }).click();
  await expect(bar).toContainText("GoToPlant ends true");
  await fitView(page);
  await picture(page, "dry-run");
  await bar.getByRole("button", { name: "Close the dry-run" }).click();

  await holdNamed(page, /^Run v1 in the simulator/);
  await expect(card(page, "Water").getByText("running")).toBeVisible({ timeout: 20_000 });
  await fitView(page);
  await page.getByRole("button", { name: "Show the lanes" }).click();
  await picture(page, "run");
  await holdNamed(page, /^Run v1 in the simulator/);
  await expect(page.getByRole("button", { name: /^Stop run 2/ })).toBeVisible();
  await page.keyboard.press("Control+.");
  await expect(page.getByText(/Run 2: stopped/)).toBeVisible();
  await context.close();
});

test("run it on a robot to practise with", async ({ browser }) => {
  test.skip(NO_ROS !== "", NO_ROS);
  test.setTimeout(180_000);
  david.start(product.data, { "*": { after_s: 20, stop_s: 0.05 } });
  const body = JSON.stringify({ name: "David", domain: DOMAIN, get_service: david.path });
  const headers = { "content-type": "application/json" };
  await product.ask("/api/robots", { method: "POST", body, headers }, product.runnerUrl);
  const { page, context } = await product.person(browser, "Ada", SIZE);
  await page.goto(`${product.url}/robots`);
  await expect(page.getByText("answers", { exact: true }).first()).toBeVisible({ timeout: 40_000 });
  await expect(page.getByText("A stop can be proven").first()).toBeVisible({ timeout: 40_000 });
  await expect(page.getByText(/^Looking for engines/)).toHaveCount(0, { timeout: 40_000 });
  await picture(page, "robot");

  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  await expect(page.getByText(/David answered after/)).toBeVisible({ timeout: 45_000 });
  await picture(page, "start");
  await holdNamed(page, /^Start v1 on David$/);
  await expect(card(page, "GoToPlant").getByText("running")).toBeVisible({ timeout: 20_000 });
  await page.keyboard.press("Control+.");
  await expect(page.getByText(/Run 3: stopped/)).toBeVisible();

  // A second time, and it is frozen while it drives.
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await holdNamed(page, /^Start v1 on David$/);
  await expect(card(page, "GoToPlant").getByText("running")).toBeVisible({ timeout: 20_000 });
  david.freeze();
  await expect(page.getByText("unknown").first()).toBeVisible({ timeout: 20_000 });
  await page.keyboard.press("Control+.");
  await expect(page.getByRole("alert")).toContainText("STOP UNCONFIRMED");
  david.thaw();
  await expect(page.getByText(/Run 4: stopped/)).toBeVisible({ timeout: 30_000 });
  await context.close();
});
