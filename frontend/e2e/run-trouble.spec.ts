/** Runs in trouble, and more than one at once: whose they are, what they wait for, why they were refused. */

import { expect, type Page, test } from "@playwright/test";
import { saved, start } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";
import { anotherDay } from "./turns";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const david = new StandIn("David");
const eve = new StandIn("Eve");
const SCRIPT = { "patrol/Work_0": { after_s: 0.5 }, "*": { after_s: 60, stop_s: 0.05 } };
let ada: Person;

interface Run {
  id: string;
  number: number;
  state: string;
  engine: string;
}

const runs = () => product.ask<Run[]>("/api/runs", {}, product.runnerUrl);
const strip = (page: Page) => page.getByRole("region", { name: "Run", exact: true });

function post<T>(path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method: "POST", body: JSON.stringify(body), headers }, base);
}

/** Starts a graph on robots as a program does, whatever stands against it. */
async function begin(graph: string, ...robots: string[]): Promise<void> {
  const version = await post<{ id: string; digest: string; umrf: unknown }>(
    `/api/graphs/${graph}/versions`,
    {},
    product.url,
  );
  const codes = ["H7", "H8", "others", "quiet", "actions", "unknown-action"];
  const common = {
    ...{ version: version.id, digest: version.digest, umrf: version.umrf, graph },
    ...{ request_id: `${robots} ${graph}`, override: { codes, reason: "it is a test" } },
  };
  const [engine, ...others] = robots;
  if (others.length === 0) await post("/api/runs", { ...common, engine });
  else await post("/api/groups", { ...common, engines: robots });
}

const work = (instance_id: number) => ({ name: "Work", instance_id });
const speed = { speed: { pvf_type: "number" } };

/** Two actions, of which one lacks its speed. */
async function lacking(which: 0 | 1): Promise<string> {
  const input = (each: number) => (each === which ? { input_parameters: speed } : {});
  const { id } = await post<{ id: string }>(
    "/api/graphs",
    {
      graph_name: "patrol",
      graph_entry: [work(0)],
      graph_exit: [work(1)],
      actions: [
        { ...work(0), type: "sync", children: [work(1)], ...input(0) },
        { ...work(1), type: "sync", parents: [work(0)], ...input(1) },
      ],
    },
    product.url,
  );
  return id;
}

async function stopAll(page: Page): Promise<void> {
  await page.keyboard.press("Control+.");
  await expect
    .poll(async () => (await runs()).every(({ state }) => /stopped|refused|finished/.test(state)))
    .toBe(true);
}

test.beforeAll(async ({ browser }) => {
  for (const robot of [david, eve]) robot.start(product.data, SCRIPT);
  await product.start();
  for (const { name, path } of [david, eve]) {
    await post("/api/robots", { name, domain: DOMAIN, get_service: path });
  }
  ada = await product.person(browser, "Ada");
  const states = async () =>
    (await product.ask<{ state: string }[]>("/api/robots", {}, product.runnerUrl)).map(
      ({ state }) => state,
    );
  await expect.poll(states, { timeout: 40_000 }).toEqual(["answering", "answering", "answering"]);
});

test.afterAll(async () => {
  for (const each of [david, eve]) await each.kill();
  await product.dispose();
});

test("two robots run one graph: the page says whose run it shows, and shows the other one", async () => {
  test.skip(anotherDay(0) !== "", anotherDay(0));
  const { page } = ada;
  const graph = await product.chain(3, 1);
  await begin(graph, "David", "Eve");
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  const robots = strip(page).getByRole("tablist", { name: "Who runs this graph" });
  await expect(robots.getByRole("tab")).toHaveCount(3);
  const both = robots.getByRole("tab", { name: "Both robots" });
  await expect(both).toHaveAttribute("aria-selected", "true");
  const lanes = strip(page).getByRole("list", { name: "Actions of the run over time" });
  await expect(lanes.getByText("Wait", { exact: true })).toHaveCount(2); // one lane for each robot
  const eves = robots.getByRole("tab", { name: /^Eve Wait\b/ });
  const davids = robots.getByRole("tab", { name: /^David Wait\b/ });
  await expect(page.getByRole("region", { name: "Moves now" })).toContainText("David Wait");
  await davids.click();
  await expect(davids).toHaveAttribute("aria-selected", "true");
  await expect(lanes.getByText("Wait", { exact: true })).toHaveCount(1);
  const shown = (robot: string, all: readonly Run[]) =>
    `Run ${all.find(({ engine }) => engine === robot)?.number}`;
  const all = await runs();
  await expect(strip(page).getByText(shown("David", all), { exact: true })).toBeVisible();
  await page.keyboard.press("ArrowRight");
  await expect(strip(page).getByText(shown("Eve", all), { exact: true })).toBeVisible();
  await expect(eves).toHaveAttribute("aria-selected", "true");
  await page.screenshot({ path: test.info().outputPath("two-robots.png") });
  await stopAll(page);
  await expect(robots).toHaveCount(0);
});

test("a run in which nothing moves says what it waits for, and keeps it as its cause", async () => {
  test.skip(anotherDay(1) !== "", anotherDay(1));
  const { page } = ada;
  const graph = await lacking(1);
  await begin(graph, "David");
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  const alarm = strip(page).getByRole("alert");
  await expect(alarm).toContainText("NOTHING MOVES: David calls patrol running", {
    timeout: 30_000,
  });
  await expect(alarm).toContainText("Work 1 waits for its input “speed”");
  await page.screenshot({ path: test.info().outputPath("stalled.png") });
  await stopAll(page);
  await page.goto(`${product.url}/runs/${(await runs())[0]?.id}`);
  const why = page.getByRole("region", { name: "Why" });
  await expect(why.getByRole("listitem").first()).toContainText(
    "pressed Stop while no action was seen",
  );
  await expect(why.getByRole("listitem").nth(1)).toContainText("Work_1 waits for its input");
  await page.screenshot({ path: test.info().outputPath("stalled-cause.png") });
});

test("a start that the robot holds and never begins is refused, with the reason, and the robot is free", async () => {
  test.skip(anotherDay(2) !== "", anotherDay(2));
  const { page } = ada;
  const graph = await lacking(0);
  await begin(graph, "Eve");
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await expect(strip(page).getByText("refused", { exact: true })).toBeVisible();
  await expect(strip(page)).toContainText("Work waits for its input “speed”");
  await page.screenshot({ path: test.info().outputPath("refused.png") });
  await begin(await product.chain(2, 1), "Eve");
  await expect.poll(async () => (await runs())[0]?.state).toBe("running");
  await stopAll(page);
});

test("the answer to a start on two robots gets lost: both runs are found, and nothing is sent again", async () => {
  const { page } = ada;
  const sent: string[] = [];
  await page.route(`${product.runnerUrl}/api/groups`, async (route) => {
    sent.push(route.request().postData() ?? "");
    await route.fetch();
    await route.abort("connectionreset");
  });
  await page.goto(`${product.url}/graphs/${await product.chain(3, 1)}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  for (const robot of ["David", "Eve"]) {
    const box = page.getByRole("checkbox", { name: new RegExp(`^${robot}`) });
    if (!(await box.isChecked())) await box.check();
  }
  const hold = page.getByRole("button", { name: /^Start v\d+ on David, Eve/ });
  await expect(hold).toBeEnabled({ timeout: 15_000 });
  await hold.focus();
  await page.keyboard.down("Enter");
  await expect(page.getByRole("dialog")).toBeHidden();
  await page.keyboard.up("Enter");
  const notice = page.getByRole("region", { name: "Starts without an answer" });
  for (const robot of ["David", "Eve"]) {
    await expect(notice).toContainText(new RegExp(`Started after all: run \\d+ on ${robot}`));
  }
  await page.screenshot({ path: test.info().outputPath("unsure-group.png") });
  // What is stopped before its robot has told of it is not proven to be stopped.
  await expect
    .poll(async () => (await runs()).slice(0, 2).map(({ state }) => state))
    .toEqual(["running", "running"]);
  expect(sent).toHaveLength(1);
  await expect(page.getByText("Not started")).toHaveCount(0);
  await page.unrouteAll();
  await stopAll(page);
  await notice.getByRole("button", { name: "Hide" }).click();
});

test("a dry-run does not hide a run that goes on", async () => {
  test.skip(anotherDay(1) !== "", anotherDay(1));
  const { page } = ada;
  const graph = await product.chain(4, 1);
  await begin(graph, "David");
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await expect(strip(page).getByText("David", { exact: true })).toBeVisible();
  await page.getByRole("button", { name: "Dry-run", exact: true }).first().click();
  await expect(page.getByRole("region", { name: "Dry-run" })).toBeVisible();
  await expect(strip(page).getByText("David", { exact: true })).toBeVisible();
  await expect(strip(page).getByText("running", { exact: true }).first()).toBeVisible();
  await page.screenshot({ path: test.info().outputPath("dry-run-beside.png") });
  await stopAll(page);
});

test("a run that was paused in the simulator is stopped, and nothing is said to be unconfirmed", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${await product.chain(60)}`);
  await saved(page);
  await start(page);
  await strip(page).getByRole("button", { name: "Pause" }).click();
  await expect(strip(page).getByText("paused", { exact: true }).first()).toBeVisible();
  await stopAll(page);
  await expect(page.getByText("STOP UNCONFIRMED")).toHaveCount(0);
  expect((await runs())[0]?.state).toBe("stopped");
  expect(ada.failures).toEqual([]);
});
