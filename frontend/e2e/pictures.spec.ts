/** The pictures in docs/pictures, taken by `make pictures` from the running product. */

import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, saved, start } from "./bench";
import { Product } from "./product";
import { DOMAIN, NO_ROS, StandIn } from "./robot";

test.skip(process.env.PICTURES !== "1", "takes pictures for the documentation: make pictures");

const FOLDER = resolve(
  process.env.PICTURES_TO ?? resolve(import.meta.dirname, "../../docs/pictures"),
);
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
    await page.goto(await graph("valve_inspection"));
    await saved(page);
    await page.getByRole("button", { name: "Dry-run" }).click();
    const bar = page.getByRole("region", { name: "Dry-run" });
    await expect(bar).toContainText("runs");
    await bar.getByRole("button", { name: "Next moment" }).click();
    await bar.getByRole("button", { name: /^error/ }).click();
    await expect(bar).toContainText("ends with an error");
    await page.waitForTimeout(600);
    await picture(page, `dry-run-${scheme}`);
    await context.close();
    await mari.context.close();
  });
}

/** The same graph with robots, so that they can be told apart. */
async function withRobots(name: string): Promise<string> {
  const url = await graph(name);
  const id = url.split("/").at(-1);
  const file = await product.ask<{ graph_name: string; actions: Record<string, unknown>[] }>(
    `/api/graphs/${id}/umrf`,
  );
  const body = JSON.stringify({
    ...file,
    graph_name: "night_round",
    gui_attributes: { labels: ["night shift"] },
    actions: file.actions.map((action, i) => ({ ...action, actor: i % 3 === 2 ? "arm" : "rover" })),
  });
  const headers = { "content-type": "application/json" };
  const made = await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers });
  return `${product.url}/graphs/${made.id}`;
}

for (const scheme of ["light", "dark"] as const) {
  test(`what a graph says, ${scheme}`, async ({ browser }) => {
    const options = { colorScheme: scheme, viewport: { width: 1440, height: 900 } };
    const { page, context } = await product.person(browser, "Ada", options);
    await page.goto(await withRobots("fetch_tool"));
    await saved(page);
    const first = page.locator(".react-flow__node-action").first();
    await first.click({ position: { x: 50, y: 30 } });
    await page.keyboard.press("m");
    const say = page.getByRole("textbox", { name: /^Comment on/ });
    await say.fill("Slower in the aisle, people walk here at night.");
    await say.press("ControlOrMeta+Enter");
    await expect(page.getByRole("button", { name: "Resolve" })).toBeVisible();
    await page.keyboard.press("o");
    await page.waitForTimeout(600);
    await picture(page, `outline-${scheme}`);
    await page.getByRole("tab", { name: "JSON" }).click();
    await expect(page.getByRole("textbox", { name: "JSON of the graph" })).toBeVisible();
    await page.getByRole("button", { name: /^arm/ }).click();
    await page.waitForTimeout(600);
    await picture(page, `json-${scheme}`);
    await context.close();
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
    if (name === "phone") {
      await page.getByRole("radiogroup").getByText("Outline", { exact: true }).tap();
      await page.waitForTimeout(500);
      await picture(page, "outline-phone");
    }
    await context.close();
  });
}

test.describe("robots", () => {
  test.skip(NO_ROS !== "", NO_ROS);
  test.skip(process.env.E2E_ALL !== "1", "takes a minute that CI does not have: E2E_ALL=1");
  const david = new StandIn("David");
  const eve = new StandIn("Eve");

  test.beforeAll(async () => {
    for (const robot of [david, eve]) robot.start(product.data, { after_s: 20, stop_s: 0.05 });
    for (const { name, path } of [david, eve, new StandIn("Rover")]) {
      await product.ask(
        "/api/robots",
        {
          method: "POST",
          body: JSON.stringify({ name, domain: DOMAIN, get_service: path }),
          headers: { "content-type": "application/json" },
        },
        product.runnerUrl,
      );
    }
  });
  test.afterAll(() => Promise.all([david.end(), eve.kill()]));

  async function chosen(page: Page, url: string, robots: string[]): Promise<void> {
    await page.goto(url);
    await saved(page);
    const phone = page.getByRole("radiogroup").getByText("Run", { exact: true });
    if (await phone.isVisible()) await phone.tap();
    await page.getByRole("button", { name: "Choose where to start" }).click();
    for (const robot of robots) {
      await page.getByRole("checkbox", { name: new RegExp(`^${robot}`) }).check();
    }
    await expect(page.getByText(/^David answered after/)).toBeVisible();
  }

  for (const scheme of ["light", "dark"] as const) {
    test(`are watched and looked at, ${scheme}`, async ({ browser }) => {
      const options = { colorScheme: scheme, viewport: { width: 1440, height: 900 } };
      const { page, context } = await product.person(browser, "Ada", options);
      const url = `${product.url}/graphs/${await product.chain(3)}`;
      await page.goto(`${product.url}/robots`);
      await expect(page.getByText("answers", { exact: true })).toHaveCount(2, { timeout: 40_000 });
      await chosen(page, url, ["David", "Rover"]);
      await page.waitForTimeout(2_500);
      await picture(page, `start-${scheme}`);
      await page.getByRole("checkbox", { name: /^Rover/ }).uncheck();
      const begin = page.getByRole("button", { name: /^Start v\d+ on David/ });
      await expect(begin).toBeEnabled();
      await begin.focus();
      await page.keyboard.down("Enter");
      await page.waitForTimeout(900);
      await page.keyboard.up("Enter");
      await expect(page.getByText(/proof \d/)).toBeVisible();
      await page.goto(`${product.url}/robots`);
      await page.getByRole("tab", { name: "What others told it" }).first().click();
      await page.waitForTimeout(1_200);
      await picture(page, `robots-${scheme}`);
      await page.keyboard.press("Control+.");
      await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
      await context.close();
    });
  }

  test("on a phone, and one that dies", async ({ browser }) => {
    const options = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
    const { page, context } = await product.person(browser, "Ada", options);
    await page.goto(`${product.url}/robots`);
    await page.waitForTimeout(1_200);
    await picture(page, "robots-phone");
    await chosen(page, `${product.url}/graphs/${await product.chain(3)}`, ["David", "Eve"]);
    await page.waitForTimeout(600);
    await picture(page, "start-phone");
    await page.getByRole("checkbox", { name: /^David/ }).uncheck();
    const begin = page.getByRole("button", { name: /^Start v\d+ on Eve/ });
    await expect(begin).toBeEnabled();
    await begin.focus();
    await page.keyboard.down("Enter");
    await page.waitForTimeout(900);
    await page.keyboard.up("Enter");
    await expect(page.getByRole("button", { name: /^Stop run/ })).toBeVisible();
    await eve.kill();
    await page.getByRole("button", { name: /^Stop run/ }).tap();
    await expect(page.getByRole("alert")).toContainText("STOP UNCONFIRMED");
    await page.waitForTimeout(1_500);
    await picture(page, "stop-unconfirmed-phone");
    await context.close();
  });
});
