/** Robots, from the page to a stand-in over real rclpy and back: to the end, to a stop, and worse. */

import { expect, type Page, test } from "@playwright/test";
import { saved } from "./bench";
import { type Person, Product } from "./product";
import { DOMAIN, NO_ROS, StandIn, Stranger } from "./robot";

test.skip(NO_ROS !== "", NO_ROS);
test.skip(process.env.E2E_ALL !== "1", "takes a minute that CI does not have: E2E_ALL=1");
test.describe.configure({ mode: "serial" });

const product = new Product();
const david = new StandIn("David");
const eve = new StandIn("Eve");
const stranger = new Stranger();
const SLOW = { after_s: 60, stop_s: 0.05 };
let ada: Person;

test.beforeAll(async ({ browser }) => {
  await product.start();
  david.start(product.data, { after_s: 3 });
  eve.start(product.data, SLOW);
  ada = await product.person(browser, "Ada");
});

test.afterAll(async () => {
  for (const each of [stranger, david, eve]) await each.kill();
  await product.dispose();
});

const card = (page: Page, robot: string) => page.getByRole("article", { name: robot });
const alarm = (page: Page) => page.getByRole("alert").filter({ hasText: "STOP UNCONFIRMED" });

async function hold(page: Page, name: RegExp): Promise<void> {
  const button = page.getByRole("button", { name });
  await expect(button).toBeEnabled({ timeout: 15_000 });
  await button.focus();
  await page.keyboard.down("Enter");
  await page.waitForTimeout(900);
  await page.keyboard.up("Enter");
}

/** Chooses robots in the start dialog and holds Start. */
async function startOn(page: Page, graph: string, robots: string[]): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  for (const robot of robots) {
    const box = page.getByRole("checkbox", { name: new RegExp(`^${robot}`) });
    if (!(await box.isChecked())) await box.check();
  }
  for (const robot of robots) {
    const list = page.getByRole("list", { name: `Looked at on ${robot}` });
    await expect(list.getByText("A stop can be proven")).toBeVisible();
  }
  await hold(page, new RegExp(`^Start v\\d+ on ${robots.join(", ")}`));
  await expect(page.getByRole("dialog")).toBeHidden();
}

interface Run {
  number: number;
  state: string;
  proof_at: string | null;
  group: string | null;
}

const runs = () => product.ask<Run[]>("/api/runs", {}, product.runnerUrl);

test("a robot is registered in the page and shows how it is", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/robots`);
  for (const robot of [david, eve]) {
    await page.getByRole("button", { name: "Register a robot" }).click();
    await page.getByRole("textbox", { name: "Name" }).fill(robot.name);
    await page.getByRole("textbox", { name: "ROS domain" }).fill(String(DOMAIN));
    await page.getByRole("button", { name: "Path, middleware and engine …" }).click();
    await page.getByRole("textbox", { name: "Path of its get service" }).fill(robot.path);
    await page.getByRole("button", { name: "Register", exact: true }).click();
    await expect(card(page, robot.name).getByText("answers", { exact: true })).toBeVisible({
      timeout: 20_000,
    });
    await expect(card(page, robot.name).getByText("A stop can be proven")).toBeVisible();
  }
});

test("a graph runs on the robot to its end, live in the page", async () => {
  const { page } = ada;
  await startOn(page, await product.chain(2), ["David"]);
  await expect(page.locator('[data-tone="run"]').first()).toBeVisible();
  await expect(page.getByText(/proof \d+\.\d s ago/)).toBeVisible();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 20_000 }).toBe("finished");
  await expect(page.getByText("finished", { exact: true }).first()).toBeVisible();
});

test("two robots run together, and one press of keys stops both until it is proven", async () => {
  const { page } = ada;
  await david.end();
  david.start(product.data, SLOW);
  await page.goto(`${product.url}/robots`);
  await expect(
    card(page, "David")
      .getByText(/answers|restarted/)
      .first(),
  ).toBeVisible({
    timeout: 40_000,
  });
  await startOn(page, await product.chain(3), ["David", "Eve"]);
  await expect
    .poll(async () => (await runs()).slice(0, 2).map((run) => run.state))
    .toEqual(["running", "running"]);
  await page.getByRole("textbox").first().focus(); // also while somebody types
  await page.keyboard.press("Control+.");
  await expect(page.getByText(/Run \d+: stopped · Run \d+: stopped/)).toBeVisible();
  await expect
    .poll(async () => (await runs()).slice(0, 2).map((run) => run.state), {
      timeout: 15_000,
    })
    .toEqual(["stopped", "stopped"]);
  const [one, other] = await runs();
  expect(one?.proof_at).not.toBeNull();
  expect(one?.group).toBe(other?.group);
});

test("a start of somebody else is seen, named, imported and stopped", async () => {
  const { page } = ada;
  const id = await product.chain(1);
  const graph = await product.ask<Record<string, unknown>>(`/api/graphs/${id}/umrf`);
  stranger.start("Eve", JSON.stringify({ ...graph, graph_name: "theirs" }));
  await page.goto(`${product.url}/robots`);
  const there = card(page, "Eve");
  await expect(there.getByText("not started from here")).toBeVisible({ timeout: 30_000 });
  await expect(there.getByText("1 other program can start things there")).toBeVisible();
  await there.getByRole("tab", { name: "What others told it" }).click();
  await expect(there.getByText("Somebody else started theirs")).toBeVisible();
  await there.getByRole("button", { name: "Stop", exact: true }).click();
  await expect(there.getByText("theirs is proven to have stopped")).toBeVisible({
    timeout: 15_000,
  });
  await there.getByRole("button", { name: "Import", exact: true }).click();
  await expect(page.getByRole("heading", { name: "theirs" })).toBeVisible();
  await stranger.end();
});

test("of a robot that died nothing is claimed, and its stop is loud", async () => {
  const { page } = ada;
  await expect
    .poll(
      async () => {
        const engine = await product.ask<{ others: number }>(
          "/api/robots/Eve",
          {},
          product.runnerUrl,
        );
        return engine.others;
      },
      { timeout: 40_000 },
    )
    .toBe(0);
  await startOn(page, await product.chain(2), ["Eve"]);
  await expect.poll(async () => (await runs())[0]?.state).toBe("running");
  await eve.kill();
  await expect(page.getByText(/unknown since/).first()).toBeVisible({ timeout: 20_000 });
  await page.getByRole("button", { name: /^Stop run/ }).click();
  await expect(alarm(page)).toContainText("Eve");
  const [newest] = await runs();
  expect(["unknown", "stopping"]).toContain(newest?.state);
  expect(ada.failures).toEqual([]);
});
