/** A run of three levels looked back on: opened in place, entered where it failed, compared inside; and files for a robot. */

import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { LONG, type Person, Product } from "./product";
import { post, violations } from "./valves";

const SLOWLY = { timeout: 30_000 };
const folder = mkdtempSync(join(tmpdir(), "review-levels-"));
const packages = join(folder, "packages");
mkdirSync(packages);
const product = new Product(["--index-folder", `David=${packages}`]);
let ada: Person;
let round: string;
const runs: string[] = [];

const named = (name: string) => ({ name, instance_id: 0 });
/** Actions that follow each other. */
const line = (graph: string, ...names: string[]) => ({
  graph_name: graph,
  graph_entry: names.slice(0, 1).map(named),
  graph_exit: names.slice(-1).map(named),
  actions: names.map((name, i) => ({
    ...{ ...named(name), type: "sync" },
    parents: names.slice(Math.max(0, i - 1), i).map(named),
    children: names.slice(i + 1, i + 2).map(named),
  })),
});

interface Version {
  id: string;
  digest: string;
  umrf: object;
  tree_digest: string;
  subgraphs: { name: string; digest: string; umrf: object; graph: string }[];
}

/** Runs it in the simulator; CloseFingers ends so. */
async function ran(result: string): Promise<void> {
  const version = await post<Version>(product, `/api/graphs/${round}/versions`, {});
  const { id, digest, umrf, tree_digest } = version;
  const subgraphs = version.subgraphs.map(({ name, digest, umrf, graph }) => ({
    ...{ name, digest, umrf, graph },
  }));
  const last = { after_s: 0.3, result, message: "jammed" };
  const script = { behaviours: { CloseFingers: [last], "*": [{ after_s: 0.3 }] } };
  const order = { version: id, digest, umrf, graph: round, engine: "simulator", script };
  const request_id = `levels ${result}`;
  const body = { ...order, request_id, subgraphs, tree_digest };
  const run = await post<{ id: string }>(product, "/api/runs", body, product.runnerUrl);
  runs.push(run.id);
  const path = `/api/runs/${run.id}`;
  const state = async () =>
    (await product.ask<{ state: string }>(path, {}, product.runnerUrl)).state;
  await expect.poll(state).toBe("finished");
}

test.skip(LONG !== "", LONG);
test.describe.configure({ mode: "serial" });
test.beforeAll(async ({ browser }) => {
  await product.start();
  await post(product, "/api/graphs", line("Grip", "OpenFingers", "CloseFingers"));
  await post(product, "/api/graphs", line("Fetch", "Drive", "Grip"));
  round = (await post<{ id: string }>(product, "/api/graphs", line("Round", "Greet", "Fetch"))).id;
  await ran("on_true");
  await ran("on_error");
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
  rmSync(folder, { recursive: true });
});

const lanes = (page: Page) =>
  page.getByRole("list", { name: "Actions of the run over time" }).locator("[data-lane]");
const opens = (page: Page, way: string) =>
  page.getByRole("button", { name: `What ran inside of ${way}`, exact: true });

test("what ran inside opens in place, level by level or all at once, and stays open in the replay", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${runs[1]}`);
  await expect(lanes(page)).toHaveText([/^Greet/, /^Fetch/]);
  await expect(opens(page, "Fetch")).toHaveAttribute("aria-expanded", "false");
  await opens(page, "Fetch").focus();
  await page.keyboard.press("Enter");
  await expect(lanes(page)).toHaveText([/^Greet/, /^Fetch/, /^Drive/, /^Grip/]);
  await opens(page, "Fetch › Grip").click();
  await expect(lanes(page)).toHaveCount(6);
  expect(await violations(page)).toEqual([]);
  const all = page.getByRole("button", { name: "All levels" });
  await all.click();
  await expect(lanes(page)).toHaveCount(2);
  await all.click();
  await expect(lanes(page)).toHaveCount(6);
  await page.locator("[data-ruler]").click({ position: { x: 200, y: 8 } });
  await expect(page.getByText("as it was then")).toBeVisible();
  await expect(lanes(page)).toHaveCount(6);
  await expect(page.getByText("Fetch › Grip › CloseFingers").first()).toBeVisible();
});

test("the cause leads into the level where it failed, as an address tells it; and out again", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${runs[1]}`);
  const why = page.getByRole("region", { name: "Why" });
  await expect(why).toContainText("Fetch › Grip › CloseFingers ended in error: “jammed”");
  await why.getByRole("button", { name: "Show it inside" }).click();
  const failed = card(page, "CloseFingers");
  await expect(failed).toHaveClass(/\bselected\b/);
  await expect(failed.getByText(/running|error/)).toBeVisible();
  await expect(page).toHaveURL(new RegExp(`/runs/${runs[1]}\\?in=${round}.*&in=.*&t=\\d+&action=`));
  await page.reload();
  await expect(card(page, "OpenFingers").getByText("true")).toBeVisible();
  await expect(page.getByText("as it was then")).toBeVisible();
  const way = page.getByRole("navigation", { name: "Levels" });
  await expect(way).toHaveText("RoundFetchGrip");
  await way.getByRole("button", { name: "Fetch" }).click();
  await expect(card(page, "Grip")).toHaveClass(/\bselected\b/);
  await expect(page.getByText("as it was then")).toBeVisible();
  await page.getByRole("button", { name: "End", exact: true }).click();
  await page.getByRole("button", { name: "Inside Grip" }).click();
  await expect(card(page, "CloseFingers").getByText("error")).toBeVisible();
  expect(await violations(page)).toEqual([]);
  await page.getByRole("link", { name: "Graph", exact: true }).click();
  await expect(page.getByRole("navigation", { name: "Where you are" })).toContainText(
    "Graphs/Round/Fetch/Grip",
  );
});

test("two runs are compared inside, and statistics count by levels; on a phone, too", async () => {
  const { page } = ada;
  await page.setViewportSize({ width: 390, height: 844 });
  await page.goto(`${product.url}/runs/compare?a=${runs[0]}&b=${runs[1]}`);
  await expect(page.getByText("Fetch › Grip › CloseFingers: true in run 1")).toBeVisible();
  const both = page.getByRole("region", { name: "Both runs over time" });
  await expect(both.getByRole("listitem")).toHaveCount(2);
  await page.getByRole("button", { name: "All levels" }).click();
  await expect(both.getByRole("listitem")).toHaveCount(6);
  await expect(both.locator("[data-parting]")).toContainText("CloseFingers");
  expect(await violations(page)).toEqual([]);
  await page.goto(`${product.url}/runs/statistics?graph=${round}`);
  await expect(
    page.getByRole("row").filter({ hasText: "Fetch › Grip › CloseFingers" }),
  ).toContainText("2");
  await page.goto(`${product.url}/runs/${runs[1]}`);
  await opens(page, "Fetch").click();
  await expect(lanes(page)).toHaveCount(4);
  await page.setViewportSize({ width: 1280, height: 800 });
});

/** The packages of a robot that has all actions and no graph. */
function packagesOf(actions: string[]): string {
  for (const name of actions) {
    mkdirSync(join(packages, name), { recursive: true });
    const action = { name, type: "sync", instance_id: 0 };
    writeFileSync(join(packages, name, `${name}.umrf.json`), JSON.stringify(action));
  }
  return packages;
}

const NAME = "Write the graphs where David looks them up";

/** What is looked at before a start on David. */
async function lookedAtDavid(page: Page) {
  await page.goto(`${product.url}/graphs/${round}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).first().click();
  await page.getByRole("checkbox", { name: /David/ }).click();
  return page.getByRole("list", { name: "Looked at on David" });
}

test("where a robot lacks a graph inside its files are offered, and one graph without any", async () => {
  test.skip(NO_ROS !== "", NO_ROS);
  const { page } = ada;
  const david = new StandIn("David", packagesOf(["Greet", "Drive", "OpenFingers", "CloseFingers"]));
  david.start(folder, { "*": { after_s: 0.2 } });
  try {
    const robot = { name: "David", domain: DOMAIN, get_service: david.path };
    await post(product, "/api/robots", robot, product.runnerUrl);
    const looked = await lookedAtDavid(page);
    await expect(looked).toContainText("David has not indexed Fetch, Grip", { timeout: 30_000 });
    const download = page.waitForEvent("download");
    await looked.getByRole("link", { name: "Files of the graphs inside (ZIP)" }).click();
    const listed = execFileSync("python3", ["-m", "zipfile", "-l", await (await download).path()]);
    expect(String(listed)).toMatch(/Fetch\.umrf\.graph\.json[\s\S]*Grip\.umrf\.graph\.json/);
    expect(await violations(page)).toEqual([]);
    await looked.getByRole("link", { name: "Make it one graph" }).click();
    await expect(
      page.getByRole("dialog", { name: "One graph without graphs inside" }),
    ).toContainText("CloseFingers_0");
    await expect(page.getByRole("dialog", { name: /^Start/ })).toHaveCount(0);
    await expect(page).toHaveURL(`${product.url}/graphs/${round}`);
  } finally {
    await david.end();
  }
});

test("where the runner has the robot's folder, what it lacks is written there and the start goes", async () => {
  test.skip(NO_ROS !== "", NO_ROS);
  const { page } = ada;
  const other = join(packages, "grip.graph.json");
  writeFileSync(other, JSON.stringify(line("Grip", "OpenFingers")));
  const david = new StandIn("David", packages);
  david.start(folder, { "*": { after_s: 0.2 } });
  try {
    await page.setViewportSize({ width: 390, height: 844 });
    const onPhone = (await lookedAtDavid(page)).getByRole("button", { name: NAME });
    await onPhone.scrollIntoViewIfNeeded(SLOWLY);
    await expect(onPhone).toBeInViewport({ ratio: 1 });
    expect(await violations(page)).toEqual([]);
    await page.setViewportSize({ width: 1280, height: 800 });
    const looked = await lookedAtDavid(page);
    await expect(looked).toContainText(`Fetch, Grip can be written into ${packages}`, SLOWLY);
    await expect(looked).toContainText(
      "grip.graph.json, which has another Grip, would be replaced",
    );
    expect(await violations(page)).toEqual([]);
    const write = looked.getByRole("button", { name: NAME });
    await write.focus();
    await page.keyboard.press("Enter"); // no hold: it asks
    await expect(page.getByText("A copy of the present state is kept beside it.")).toBeVisible();
    await page
      .getByRole("button", { name: `${NAME}, and replace grip.graph.json` })
      .last()
      .press("Enter");
    // Whoever is quick enough has never been waited for.
    await expect(looked.getByRole("status")).toContainText(/Waiting until David|David has indexed/);
    await expect(looked).toContainText("Written, and David has indexed it.", SLOWLY);
    await expect(looked).toContainText("David has indexed Fetch, Grip as this version has it.");
    expect(await violations(page)).toEqual([]);
    const there = readdirSync(packages).filter((name) => /Fetch|grip/.test(name));
    expect(there.sort().join(" ")).toMatch(
      /^Fetch\.umrf\.graph\.json grip\.graph\.json grip\.graph_json\.[0-9a-f]{8}\.replaced$/,
    );
    await expect(
      page.getByRole("dialog").getByRole("button", { name: /^Start .* on David$/ }),
    ).toBeEnabled(SLOWLY);
    await page.goto(`${product.url}/robots`);
    await page.getByRole("tab", { name: "What others told it" }).click();
    await expect(page.getByText(/Ada wrote Fetch \(Fetch\.umrf\.graph\.json\)/)).toBeVisible(
      SLOWLY,
    );
  } finally {
    await david.end();
  }
});
