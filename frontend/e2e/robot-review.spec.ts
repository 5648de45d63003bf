/** Looking back on runs of stand-in robots over real rclpy: failure, stop, loop, two robots, a gap,
 * somebody else's start. All of it runs first, side by side; then the pages are looked at. */

import { expect, type Page, test } from "@playwright/test";
import { card } from "./canvas";
import { DOMAIN, NO_ROS, StandIn, Stranger } from "./emulated-robot";
import { type Person, Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

interface Run {
  graph: string;
  id: string;
  state: string;
  result: string | null;
  group: string | null;
}

interface Version {
  id: string;
  digest: string;
  umrf: string;
}

const VIDEO = "https://nvr.lab.example";
const product = new Product([], "", {
  ACTION_ASSISTANT_RUN_LINKS: `Video=${VIDEO}/{robot}?from={from}&at={at_ms}`,
});
const david = new StandIn("David");
const eve = new StandIn("Eve");
const stranger = new Stranger();
const runs: Record<string, Run> = {};
const JSON_TYPE = { "content-type": "application/json" };
const ENDED = /finished|halted|stopped|error|lost/;
let ada: Person;

const QUICK = { after_s: 0.6 };
const DOES = {
  Jam: [{ init_error: true }], // a robot shows what was thrown, never a result
  Check: [
    { after_s: 0.4, result: "on_false" },
    { after_s: 0.4, result: "on_false" },
    { after_s: 0.4 },
  ],
  Patrol: [{ after_s: 60, stop_s: 0.05 }],
  Wait: [{ after_s: 7 }],
  "*": [QUICK],
};

const node = (name: string) => ({ name, instance_id: 0 });

/** One action after the other. */
function line(graph_name: string, ...names: string[]): object {
  return {
    graph_name,
    graph_entry: [node(names[0] ?? "")],
    graph_exit: [node(names.at(-1) ?? "")],
    actions: names.map((name, i) => ({
      ...node(name),
      type: "sync",
      parents: i === 0 ? [] : [node(names[i - 1] ?? "")],
      children: i === names.length - 1 ? [] : [node(names[i + 1] ?? "")],
    })),
  };
}

/** `Check` sends back to `Turn` as long as it ends false. */
function loop(): object {
  const on = (name: string, outcome: string, required = true) => ({
    ...node(name),
    required,
    conditions: ["on_true", "on_false", "on_error", "on_stopped"].map(
      (each) => `${each} -> ${each === outcome ? "run" : "ignore"}`,
    ),
  });
  return {
    graph_name: "around",
    graph_entry: [node("Turn")],
    graph_exit: [node("Park")],
    actions: [
      {
        ...node("Turn"),
        type: "sync",
        parents: [on("Check", "on_false", false)],
        children: [node("Check")],
      },
      {
        ...node("Check"),
        type: "sync",
        parents: [on("Turn", "on_true")],
        children: [node("Turn"), node("Park")],
      },
      { ...node("Park"), type: "sync", parents: [on("Check", "on_true")], children: [] },
    ],
  };
}

async function made(graph: object): Promise<{ graph: string } & Version> {
  const post = { method: "POST", headers: JSON_TYPE };
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    ...post,
    body: JSON.stringify(graph),
  });
  const version = await product.ask<Version>(`/api/graphs/${id}/versions`, { ...post, body: "{}" });
  const whole = await product.ask<{ umrf: unknown }>(`/api/versions/${version.id}`);
  return { ...version, graph: id, umrf: JSON.stringify(whole.umrf) };
}

/** Starts as a program does; pages are for looking back here. */
async function started(what: { graph: string } & Version, ...robots: string[]): Promise<Run> {
  const { umrf, id: version, digest, graph } = what;
  const engine = robots.length === 1 ? { engine: robots[0] } : { engines: robots };
  const codes = ["H2", "H3", "H5", "H7", "H8", "H12", "others", "actions"];
  const override = { codes, reason: "practice" };
  const request_id = `e2e-${Math.random()}`;
  const body = JSON.stringify({ version, digest, graph, ...engine, request_id, override, umrf });
  const path = robots.length === 1 ? "/api/runs" : "/api/groups";
  const answer = await product.ask<Run & { runs?: Run[] }>(
    path,
    { method: "POST", body },
    product.runnerUrl,
  );
  return answer.runs?.[0] ?? answer;
}

const now = (run: Run) => product.ask<Run>(`/api/runs/${run.id}`, {}, product.runnerUrl);

async function over(run: Run): Promise<Run> {
  await expect.poll(async () => (await now(run)).state, { timeout: 30_000 }).toMatch(ENDED);
  return now(run);
}

async function answers(robot: StandIn): Promise<void> {
  await expect
    .poll(
      async () =>
        (await product.ask<{ state: string }>(`/api/robots/${robot.name}`, {}, product.runnerUrl))
          .state,
      { timeout: 30_000 },
    )
    .toBe("answering");
}

async function onDavid(): Promise<void> {
  runs.good = await over(await started(await made(line("grasp", "Reach", "Grip")), "David"));
  runs.bad = await over(await started(await made(line("grasp", "Reach", "Jam")), "David"));
  runs.loop = await over(await started(await made(loop()), "David"));
}

async function onEve(): Promise<void> {
  runs.gap = await started(await made(line("quiet", "Wait")), "Eve");
  await expect.poll(async () => (await now(runs.gap as Run)).state).toBe("running");
  eve.freeze();
  await expect
    .poll(async () => (await now(runs.gap as Run)).state, { timeout: 15_000 })
    .toBe("unknown");
  eve.thaw();
  await over(runs.gap);
}

async function together(): Promise<void> {
  runs.two = await started(await made(line("patrol", "Patrol")), "David", "Eve");
  await expect.poll(async () => (await now(runs.two as Run)).state).toBe("running");
  await product.ask(
    `/api/runs/${runs.two.group}/stop`,
    { method: "POST", body: "{}", headers: JSON_TYPE },
    product.runnerUrl,
  );
  await over(runs.two);
}

async function disturbed(): Promise<void> {
  const watch = await made(line("watch", "Patrol"));
  runs.foreign = await started(watch, "David");
  await expect.poll(async () => (await now(runs.foreign as Run)).state).toBe("running");
  stranger.start("David", watch.umrf, 3);
  await over(runs.foreign);
}

test.beforeAll(async ({ browser }) => {
  test.setTimeout(90_000);
  await product.start();
  david.start(product.data, DOES);
  eve.start(product.data, DOES);
  for (const robot of [david, eve]) {
    const body = JSON.stringify({
      name: robot.name,
      domain: DOMAIN,
      get_service: robot.path.slice(1),
    });
    await product.ask(
      "/api/robots",
      { method: "POST", body, headers: JSON_TYPE },
      product.runnerUrl,
    );
  }
  [ada] = await Promise.all([product.person(browser, "Ada"), answers(david), answers(eve)]);
  await Promise.all([onDavid(), onEve()]);
  await together();
  await disturbed();
});

test.afterAll(async () => {
  eve.thaw();
  for (const each of [stranger, david, eve]) await each.kill();
  await product.dispose();
});

async function open(page: Page, run: Run | undefined): Promise<void> {
  await page.goto(`${product.url}/runs/${run?.id}`);
  await expect(page.getByRole("list", { name: "Actions of the run over time" })).toBeVisible();
}

const why = (page: Page) => page.getByRole("region", { name: "Why" });
const lanes = (page: Page) => page.getByRole("list", { name: "Actions of the run over time" });

test("a failure: its cause, its lane, and the replay that does not know it yet", async () => {
  const { page } = ada;
  expect(runs.good?.state).toBe("finished");
  await open(page, runs.bad);
  await expect(why(page)).toContainText("Jam ended in error");
  await expect(lanes(page).getByRole("listitem").filter({ hasText: "Jam" })).toContainText("error");
  await page.getByRole("button", { name: "To the start" }).click();
  await expect(page.getByText("as it was then")).toBeVisible();
  await expect(card(page, "Jam").getByText("error")).toBeHidden();
  await page.keyboard.press("End");
  await expect(card(page, "Jam").getByText("error")).toBeVisible();
});

test("what a camera saw is one link away, at the moment that is shown", async () => {
  const { page } = ada;
  await open(page, runs.bad);
  await page.getByRole("tab", { name: "Facts" }).click();
  const link = page.getByRole("link", { name: "Video" });
  await expect(link).toHaveAttribute("href", new RegExp(`^${VIDEO}/David\\?from=20`));
  const end = await link.getAttribute("href");
  await page.getByRole("button", { name: "To the start" }).click();
  await expect(link).not.toHaveAttribute("href", end ?? "");
});

test("the good and the bad one part where it jammed, and the graph had changed there", async () => {
  const { page } = ada;
  await page.goto(
    `${product.url}/runs/compare?${new URLSearchParams({ a: runs.good?.id ?? "", b: runs.bad?.id ?? "" })}`,
  );
  await expect(page.getByRole("list", { name: "What changed in the graph" })).toContainText("Jam");
  await expect(card(page, "Jam").getByText("1 · first difference")).toBeVisible();
  await page.getByRole("tab", { name: "Step by step" }).click();
  await expect(page.getByRole("row").filter({ hasText: "here they part" })).toBeVisible();
});

test("what ran on the robot is repeated in the simulator with one fault", async () => {
  const { page } = ada;
  await open(page, runs.good);
  await page.getByRole("button", { name: "Again" }).click();
  await page.getByRole("menuitem", { name: "With one fault …" }).click();
  await page.getByRole("combobox", { name: "Action" }).click();
  await page.getByRole("option", { name: "Reach" }).click();
  await page.getByRole("button", { name: "Run in the simulator" }).click();
  await expect(page).not.toHaveURL(new RegExp(runs.good?.id ?? ""));
  await expect(page.getByText("simulated", { exact: true })).toBeVisible();
  await expect(card(page, "Reach").getByText("error")).toBeVisible({ timeout: 15_000 });
});

test("a loop shows its visits, as many as were seen", async () => {
  const { page } = ada;
  await open(page, runs.loop);
  await expect(card(page, "Check").getByText(/[23]×/)).toBeVisible();
  await expect(page.getByText("again (2.)").first()).toBeVisible();
});

test("figures of a robot say what is not known, and between which bounds the rest lies", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/statistics?graph=${runs.good?.graph}`);
  const success = page.locator("section").filter({ hasText: "Success" }).first();
  await expect(success).toContainText("1 finished with an unknown result");
  await expect(page.getByText(/arrows? it is not known whether/)).toBeVisible();
  await expect(page.getByRole("row").filter({ hasText: "Grip" })).toContainText(/[–≤]/);
  await open(page, runs.good);
  await page.getByRole("tab", { name: "Facts" }).click();
  await expect(page.locator("dl > div").filter({ hasText: "Took" })).toContainText(/[–≤]/);
});

test("time without an answer is hatched, and said", async () => {
  const { page } = ada;
  await open(page, runs.gap);
  await expect(page.getByTitle(/^No answer since/)).toBeVisible();
  await expect(page.getByText("The engine answers again")).toBeVisible();
});

test("two robots share the timeline, with who stopped them and what proves it", async () => {
  const { page } = ada;
  await open(page, runs.two);
  for (const robot of ["David", "Eve"]) {
    await expect(lanes(page).getByText(robot, { exact: true })).toBeVisible(); // above its lanes
  }
  await expect(lanes(page).getByText("Patrol", { exact: true })).toHaveCount(2);
  await expect(page.getByText(/pressed Stop$/).first()).toBeVisible();
  await expect(page.getByTitle("Proven: nothing runs any more").first()).toBeVisible();
});

test("a start of somebody else is named as what ended the run", async () => {
  const { page } = ada;
  await open(page, runs.foreign);
  await expect(why(page)).toContainText("Somebody else started watch on David");
  await expect(why(page)).toContainText("this run was ended by it");
  expect(ada.failures).toEqual([]);
});
