/** What goes wrong in the lab: Stop, a crash in the middle of a run, files that are none, slips of the hand. */

import { existsSync, readFileSync } from "node:fs";
import { resolve } from "node:path";
import { expect, type Locator, type Page, test } from "@playwright/test";
import { add, card, saved, start } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

interface Graph {
  id: string;
}

interface Run {
  id: string;
  state: string;
  detail: string;
}

async function runs(graph: string): Promise<Run[]> {
  return product.ask<Run[]>(`/api/runs?graph=${graph}`, {}, product.runnerUrl);
}

/** Whichever card runs now; each does for a second only. */
function running(page: Page): Locator {
  return page.locator(".react-flow__node-action", { hasText: "running" }).first();
}

async function drop(page: Page, name: string, text: string): Promise<void> {
  const data = await page.evaluateHandle(
    ([file, content]) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([content ?? ""], file ?? "", { type: "application/json" }));
      return transfer;
    },
    [name, text],
  );
  for (const kind of ["dragenter", "dragover", "drop"]) {
    await page.dispatchEvent("body", kind, { dataTransfer: data });
  }
}

test("Stop stops, and the page shows it only when it is proven", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const graph = await product.chain(60);
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await start(page);
  await expect(running(page)).toBeVisible();
  await page.getByRole("button", { name: /^Stop run/ }).click();
  await expect(page.getByText("stopped by Ada").first()).toBeVisible();
  expect((await runs(graph)).map((run) => run.state)).toEqual(["stopped"]);
  await expect(page.getByRole("button", { name: /^Stop everything/ })).toContainText(
    "nothing runs",
  );
  expect(failures).toEqual([]);
  await context.close();
});

test("a run that was going when everything died is called lost, with the reason", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  const graph = await product.chain(61);
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await start(page);
  await expect(running(page)).toBeVisible();
  await product.kill();
  await expect(page.getByText(/unknown/i).first()).toBeVisible();
  await expect(page.getByText("finished", { exact: true })).toHaveCount(0);
  await product.start();
  await expect.poll(async () => (await runs(graph))[0]?.state).toBe("lost");
  await page.goto(`${product.url}/runs`);
  await page.getByRole("link", { name: /chain_61/ }).click();
  await expect(page.getByText(/lost/i).first()).toBeVisible();
  await expect(
    page.getByText(/The runner ended while this simulation went on/).first(),
  ).toBeVisible();
  await context.close();
});

test("a file is dropped on the page and opens as a graph", async ({ browser }) => {
  const { page, context } = await product.person(browser, "Ada");
  const shared = resolve(
    process.env.UMRF_SHARED ?? resolve(import.meta.dirname, "../../../shared"),
    "umrf/corpus/graphs/temoto-framework+temoto_action_engine_ros2",
    "examples__graphs__example_sequential_nav.umrf.graph.json",
  );
  const own = resolve(
    import.meta.dirname,
    "../../server/action_assistant/examples/search_aisles.umrf.graph.json",
  );
  const text = readFileSync(existsSync(shared) ? shared : own, "utf8");
  await drop(page, "example.umrf.graph.json", text);
  await page.waitForURL(/\/graphs\/.+/);
  const actions = (JSON.parse(text) as { actions: unknown[] }).actions.length;
  await expect(page.locator(".react-flow__node-action")).toHaveCount(actions);
  await context.close();
});

for (const [what, text, words] of [
  ["no JSON", "{ nothing", /line 1/],
  ["no UMRF", '{"a": 1}', /UMRF/],
  ["a key twice", '{"graph_name": "g", "graph_name": "h", "actions": []}', /graph_name/],
] as const) {
  test(`a file with ${what} is refused with the place and the reason`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada");
    const before = (await product.ask<Graph[]>("/api/graphs")).length;
    await drop(page, "bad.json", text);
    await expect(page.getByText(words).first()).toBeVisible();
    expect(await product.ask<Graph[]>("/api/graphs")).toHaveLength(before);
    await context.close();
  });
}

test("a graph with a ghost shows it, says so, and cannot be started", async ({ browser }) => {
  const { page, context } = await product.person(browser, "Ada");
  const ghost = {
    graph_name: "haunted",
    graph_entry: [{ name: "Missing" }],
    graph_exit: [{ name: "Here" }],
    actions: [{ name: "Here", type: "sync" }],
  };
  await drop(page, "haunted.json", JSON.stringify(ghost));
  await page.waitForURL(/\/graphs\/.+/);
  await expect(card(page, "Missing")).toContainText("not there");
  await expect(page.getByRole("button", { name: /^(Run|Start) v1/ })).toBeDisabled();
  await context.close();
});

test("undo takes back one's own edits and nobody else's", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada");
  const mari = await product.person(browser, "Mari");
  await ada.page.getByRole("button", { name: "New graph" }).first().click();
  await ada.page.waitForURL(/\/graphs\/.+/);
  await mari.page.goto(ada.page.url());
  await add(ada.page, "Mine");
  await expect(card(mari.page, "Mine")).toBeVisible();
  await add(mari.page, "Yours");
  await expect(card(ada.page, "Yours")).toBeVisible();
  await ada.page.getByRole("button", { name: "Undo" }).click();
  await expect(card(mari.page, "Mine")).toHaveCount(0);
  await expect(card(ada.page, "Yours")).toBeVisible();
  await expect(ada.page.getByRole("button", { name: "Undo" })).toBeDisabled();
  await ada.page.getByRole("button", { name: "Redo" }).click();
  await expect(card(mari.page, "Mine")).toBeVisible();
  await ada.context.close();
  await mari.context.close();
});

test("a stranger is shown the way in and nothing else", async ({ browser }) => {
  const page = await browser.newPage();
  await page.goto(`${product.url}/graphs/anything`);
  await expect(page.getByText(/link that the server printed/)).toBeVisible();
  await page.close();
});
