/** Robots, from the page to stand-ins over real rclpy and back: to the end, to a stop, and worse. */

import { expect, type Page, test } from "@playwright/test";
import { saved, seenRunning, watch } from "./canvas";
import { DOMAIN, NO_ROS, OlderEngine, StandIn, Stranger } from "./emulated-robot";
import { type Person, Product } from "./product";
import { anotherDay } from "./turns";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const david = new StandIn("David");
const eve = new StandIn("Eve");
const late = new StandIn("Late");
const old = new OlderEngine("Old");
const stranger = new Stranger();
/** Everything goes on for a minute, and a graph of one action ends soon. */
const SCRIPT = {
  "*": { after_s: 60, stop_s: 0.05 },
  "chain_1/Wait_0": { after_s: 2 },
  "chain_6/Wait_0": { never: true, ignores_stop: true },
};
const robots = [david, eve, late];
let ada: Person;

test.beforeAll(async ({ browser }) => {
  for (const robot of [david, eve]) robot.start(product.data, SCRIPT);
  late.start(product.data, SCRIPT, "late_ms=5000");
  old.start();
  await product.start();
  for (const { name, path } of [eve, late, old]) {
    await post("/api/robots", { name, domain: DOMAIN, get_service: path });
  }
  ada = await product.person(browser, "Ada");
});

test.afterAll(async () => {
  for (const each of [stranger, david, eve, late, old]) await each.kill();
  await product.dispose();
});

interface Run {
  id: string;
  number: number;
  state: string;
  proof_at: string | null;
  at_rest: { by: { name: string } | null; how: string } | null;
  group: string | null;
}

const card = (page: Page, robot: string) => page.getByRole("article", { name: robot });
const alarm = (page: Page) => page.getByRole("alert").filter({ hasText: "STOP UNCONFIRMED" });
const runs = () => product.ask<Run[]>("/api/runs", {}, product.runnerUrl);

function post<T>(path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method: "POST", body: JSON.stringify(body), headers }, base);
}

/** Waits until a robot answers and nothing stands in the way of proofs. */
async function answering(page: Page, robot: string): Promise<void> {
  const there = card(page, robot);
  await expect(there.getByText("answers", { exact: true })).toBeVisible({ timeout: 30_000 });
  await expect(there.getByText("A stop can be proven")).toBeVisible({ timeout: 30_000 });
}

async function hold(page: Page, name: RegExp): Promise<void> {
  const button = page.getByRole("button", { name });
  await expect(button).toBeEnabled({ timeout: 15_000 });
  await button.focus();
  await page.keyboard.down("Enter");
  await expect(page.getByRole("dialog")).toBeHidden();
  await page.keyboard.up("Enter");
}

/** Opens the start dialog of a graph and chooses robots. */
async function choose(page: Page, graph: string, robots: string[]): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  for (const robot of robots) {
    const box = page.getByRole("checkbox", { name: new RegExp(`^${robot}`) });
    if (!(await box.isChecked())) await box.check();
  }
}

const lookedAt = (page: Page, robot: string) =>
  page.getByRole("list", { name: `Looked at on ${robot}` });

/** Chooses robots in the start dialog and holds Start. */
async function startOn(page: Page, graph: string, robots: string[]): Promise<void> {
  await choose(page, graph, robots);
  for (const robot of robots) {
    await expect(lookedAt(page, robot).getByText("A stop can be proven")).toBeVisible();
  }
  await hold(page, new RegExp(`^Start v\\d+ on ${robots.join(", ")}`));
}

/** Starts a graph as a program does; its number. */
async function begin(robot: string, graph: string): Promise<number> {
  const version = await post<{ id: string; digest: string; umrf: unknown }>(
    `/api/graphs/${graph}/versions`,
    {},
    product.url,
  );
  const run = await post<Run>("/api/runs", {
    ...{ version: version.id, digest: version.digest, umrf: version.umrf },
    ...{ engine: robot, graph, request_id: `${robot} ${graph}` },
  });
  return run.number;
}

test("a robot is registered in the page and shows how it is", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/robots`);
  await page.getByRole("button", { name: "Register a robot" }).click();
  await page.getByRole("textbox", { name: "Name" }).fill(david.name);
  await page.getByRole("textbox", { name: "ROS domain" }).fill(String(DOMAIN));
  await page.getByRole("button", { name: "Path, middleware and engine …" }).click();
  await page.getByRole("textbox", { name: "Path of its get service" }).fill(david.path);
  await page.getByRole("button", { name: "Register", exact: true }).click();
  for (const robot of robots) await answering(page, robot.name);
});

test("a graph runs on the robot to its end, live in the page", async () => {
  const { page } = ada;
  await choose(page, await product.chain(1), ["David"]);
  await watch(page);
  await hold(page, /^Start v\d+ on David/);
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 20_000 }).toBe("finished");
  await expect(page.getByText("finished", { exact: true }).first()).toBeVisible();
  expect(await seenRunning(page)).toEqual(["Wait"]);
});

test("two robots run together, and one press of keys stops both until it is proven", async () => {
  const { page } = ada;
  await startOn(page, await product.chain(3, 1), ["David", "Eve"]);
  await expect
    .poll(async () => (await runs()).slice(0, 2).map((run) => run.state))
    .toEqual(["running", "running"]);
  await expect(page.getByText(/proof \d+\.\d s ago/)).toBeVisible();
  await page.getByRole("textbox").first().focus(); // also while somebody types
  await page.keyboard.press("Control+.");
  await expect(page.getByText(/Run \d+: stopped · Run \d+: stopped/)).toBeVisible({
    timeout: 15_000,
  });
  const [one, other] = await runs();
  expect([one?.state, other?.state]).toEqual(["stopped", "stopped"]);
  expect(one?.proof_at).not.toBeNull();
  expect(one?.group).toBe(other?.group);
});

test("a start of somebody else is seen, named, imported and stopped", async () => {
  const { page } = ada;
  const graph = await product.ask<object>(`/api/graphs/${await product.chain(2, 1)}/umrf`);
  stranger.start("Eve", JSON.stringify({ ...graph, graph_name: "theirs" }), robots.length + 1);
  await page.goto(`${product.url}/robots`);
  const there = card(page, "Eve");
  await expect(there.getByText("not started from here")).toBeVisible({ timeout: 30_000 });
  await expect(there.getByText("1 other program can also start graphs on it")).toBeVisible();
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

test.describe("what the page shows of an engine that", () => {
  /** A run on its robot's card, in one word. */
  const word = (robot: string, run: number) =>
    card(ada.page, robot)
      .getByRole("listitem")
      .filter({ hasText: `Run ${run} of` });

  test.beforeEach(async () => {
    await ada.page.goto(`${product.url}/robots`);
    for (const robot of ["David", "Eve"]) {
      const others = card(ada.page, robot).getByText(/other program/);
      await expect(others).toBeHidden({ timeout: 30_000 });
    }
  });

  test("falls silent, and speaks again", async () => {
    test.skip(anotherDay(0) !== "", anotherDay(0));
    const run = await begin("Eve", await product.chain(4, 1));
    await expect(word("Eve", run)).toContainText("running");
    eve.freeze();
    await expect(word("Eve", run)).toContainText("unknown since", { timeout: 15_000 });
    await expect(card(ada.page, "Eve").getByText("there, but silent")).toBeVisible();
    eve.thaw();
    await expect(word("Eve", run)).toContainText("running");
    await ada.page.keyboard.press("Control+.");
    await expect(word("Eve", run)).toBeHidden({ timeout: 15_000 });
  });

  test("gets its start late", async () => {
    test.skip(anotherDay(1) !== "", anotherDay(1));
    const run = await begin("Late", await product.chain(4, 1));
    await expect(word("Late", run)).toContainText("starting");
    await expect(word("Late", run)).toContainText("unknown since", { timeout: 15_000 });
    await expect(word("Late", run)).toContainText("running", { timeout: 15_000 });
    await ada.page.keyboard.press("Control+.");
    await expect(word("Late", run)).toBeHidden({ timeout: 15_000 });
  });

  test("runs a graph of the same name as another one, and is not meant", async () => {
    test.skip(anotherDay(2) !== "", anotherDay(2));
    const graph = await product.chain(5, 1);
    const run = await begin("David", graph);
    const other = await begin("Eve", await product.chain(5, 1));
    for (const [robot, number] of [
      ["David", run],
      ["Eve", other],
    ] as const) {
      await expect(word(robot, number)).toContainText("running");
    }
    await ada.page.goto(`${product.url}/graphs/${graph}`);
    await ada.page.getByRole("button", { name: `Stop run ${run} of chain_5` }).click();
    await expect(ada.page.getByText(`Run ${run}: stopped`)).toBeVisible({ timeout: 15_000 });
    await ada.page.goto(`${product.url}/robots`);
    await expect(word("Eve", other)).toContainText("running");
    await expect(card(ada.page, "David").getByText("Nothing runs there.")).toBeVisible();
    await ada.page.keyboard.press("Control+.");
    await expect(word("Eve", other)).toBeHidden({ timeout: 15_000 });
  });

  test("is started anew", async () => {
    test.skip(anotherDay(0) !== "", anotherDay(0));
    const run = await begin("David", await product.chain(4, 1));
    await expect(word("David", run)).toContainText("running");
    await david.end();
    await expect(word("David", run)).toBeHidden({ timeout: 15_000 });
    david.start(product.data, SCRIPT);
    await expect(card(ada.page, "David").getByText(/· restarted \d/)).toBeVisible({
      timeout: 30_000,
    });
    const [newest] = await runs();
    expect([newest?.state, newest?.proof_at, newest?.at_rest?.by]).toEqual(["lost", null, null]);
    await ada.page.goto(`${product.url}/runs/${newest?.id}`);
    await expect(ada.page.getByText("lost: its engine has ended").first()).toBeVisible();
  });

  test("speaks another generation of messages", async () => {
    test.skip(anotherDay(1) !== "", anotherDay(1));
    const { page } = ada;
    const older = "Speaks an older generation of messages: it cannot be used";
    await expect(card(page, "Old").getByText(older)).toBeVisible();
    await choose(page, await product.chain(2, 1), ["Old"]);
    await expect(lookedAt(page, "Old").getByText(/generation/)).toBeVisible();
    const start = page.getByRole("button", { name: "A check prevents the start" });
    await expect(start).toBeDisabled();
  });

  test("calls an action ERROR that does not obey: only who has looked ends that", async () => {
    const { page } = ada;
    const graph = await product.chain(6, 1);
    const run = await begin("David", graph);
    await expect(word("David", run)).toContainText("running");
    await page.goto(`${product.url}/graphs/${graph}`);
    await page.getByRole("button", { name: /^Stop run/ }).click();
    await expect(alarm(page)).toContainText("Wait did not obey", { timeout: 20_000 });
    expect((await runs())[0]?.state).toBe("stopping");
    await expect(page.getByRole("button", { name: /^Stop run/ })).toBeEnabled();
    await choose(page, await product.chain(1), ["David"]);
    await expect(lookedAt(page, "David").getByText(/Somebody has to see it at rest/)).toBeVisible();
    await page.keyboard.press("Escape");
    const look = alarm(page).getByRole("button", { name: "I looked …" });
    await look.focus();
    await page.keyboard.press("Enter");
    const words = page.getByRole("textbox", { name: "How did you see that nothing moves?" });
    await expect(words).toBeFocused();
    await expect(page.getByRole("button", { name: "Say how you saw it first" })).toBeDisabled();
    await words.fill("I stand beside it; its motors are off.");
    await hold(page, /^Confirm that run \d+ is at rest/);
    await expect(alarm(page)).toBeHidden();
    const [newest] = await runs();
    expect([newest?.state, newest?.proof_at]).toEqual(["error", null]);
    await page.goto(`${product.url}/runs/${newest?.id}`);
    await expect(page.getByText("error: seen at rest by Ada").first()).toBeVisible();
    await page.getByRole("tab", { name: "Facts" }).click();
    await expect(page.getByText(/by Ada.*“I stand beside it; its motors are off.”/)).toBeVisible();
  });

  test("never speaks again: nothing is claimed, and its Stop is loud", async () => {
    const { page } = ada;
    const graph = await product.chain(4, 1);
    const run = await begin("Eve", graph);
    await expect(word("Eve", run)).toContainText("running");
    eve.freeze();
    await expect(word("Eve", run)).toContainText("unknown since", { timeout: 20_000 });
    await page.goto(`${product.url}/graphs/${graph}`);
    await page.getByRole("button", { name: /^Stop run/ }).click();
    await expect(alarm(page)).toContainText("Eve");
    expect(["unknown", "stopping"]).toContain((await runs())[0]?.state);
    await eve.kill();
    await expect.poll(async () => (await runs())[0]?.state, { timeout: 15_000 }).toBe("lost");
    expect((await runs())[0]?.proof_at).toBeNull();
    expect(ada.failures).toEqual([]);
  });
});
