/** The page of somebody who has used nothing of led runs: nothing of these is on screen, on a phone neither. */

import { expect, type Page, test } from "@playwright/test";
import { holdEnter, saved } from "./canvas";
import { type Person, Product } from "./product";

const product = new Product();
let ada: Person;

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

/** Words of what is there once somebody uses it. */
const USED =
  /breakpoint|go on|step by step|in the queue|repeat|second person|at most|hardware stop|battery|visible page|asks you|limits|opened|values of the start/i;

async function showsNone(page: Page, nothing: RegExp): Promise<void> {
  // biome-ignore lint/performance/useDomNodeTextContent: what is on screen counts
  expect(await page.locator("body").innerText()).not.toMatch(nothing);
}

test("a graph, its run and the list of runs show nothing of led runs until they are used", async () => {
  const { page } = ada;
  const names = ["Drive", "Grip"].map((name) => ({ name, instance_id: 0 }));
  const body = JSON.stringify({
    ...{ graph_name: "plain", graph_entry: names.slice(0, 1), graph_exit: names.slice(1) },
    actions: [
      { ...names[0], type: "sync", parents: [], children: names.slice(1) },
      { ...names[1], type: "sync", parents: names.slice(0, 1), children: [] },
    ],
  });
  const headers = { "content-type": "application/json" };
  const made = await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers });
  await page.goto(`${product.url}/graphs/${made.id}`);
  await saved(page);
  await showsNone(page, USED);

  await page.getByRole("button", { name: "Choose where to start" }).click();
  const dialog = page.getByRole("dialog");
  const start = dialog.getByRole("button", { name: "Run v1 in the simulator" });
  await expect(start).toBeEnabled({ timeout: 15_000 });
  await expect(dialog.getByRole("radio", { name: /^Lead it/ })).toHaveCount(0);
  await expect(dialog.getByRole("checkbox", { name: "Repeat it" })).not.toBeChecked();
  await expect(dialog.getByRole("region", { name: /second person|queue/i })).toHaveCount(0);
  await holdEnter(page, start);

  const runs = () =>
    product.ask<{ id: string; state: string }[]>("/api/runs", {}, product.runnerUrl);
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 20_000 }).toBe("finished");
  await showsNone(page, USED);
  const [run] = await runs();
  const pages = {
    [`/runs/${run?.id}`]: "Facts",
    "/runs": "plain",
    "/": "plain",
    "/robots": "Robots",
  };
  for (const [path, content] of Object.entries(pages)) {
    for (const [width, height] of [
      [1280, 800],
      [390, 844],
    ] as const) {
      await page.setViewportSize({ width, height });
      await page.goto(`${product.url}${path}`);
      await expect(page.locator("body")).toContainText(content);
      await showsNone(page, path === "/robots" ? /breakpoint|in the queue|repeat/i : USED);
      await page.screenshot({
        path: test.info().outputPath(`${path.replaceAll("/", "_")}-${width}.png`),
      });
    }
  }
});
