/** A graph inside of another: what somebody does to it is told outside, and it runs in the simulator. */

import { expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { type Person, Product } from "./product";

const product = new Product();
let ada: Person;

/** One action, which stands for `name`, or does something itself. */
function fileOf(graph: string, name: string, exits: boolean): string {
  const end = [{ name, instance_id: 0 }];
  return JSON.stringify({
    graph_name: graph,
    graph_entry: end,
    graph_exit: exits ? end : [],
    actions: [{ name, instance_id: 0, type: "sync" }],
  });
}

const sends = (method: string, body: string) => ({
  method,
  body,
  headers: { "content-type": "application/json" },
});

const problems = (page: Page) =>
  page.getByRole("button", { name: /this prevents a start|1 wrong/ });

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

test("an edit of the graph inside is told outside, and its actions run", async () => {
  const { page } = ada;
  const inner = await product.ask<{ id: string; seq: number }>(
    "/api/graphs",
    sends("POST", fileOf("Fetch", "Step", true)),
  );
  const outer = await product.ask<{ id: string }>(
    "/api/graphs",
    sends("POST", fileOf("Task", "Fetch", true)),
  );
  await page.goto(`${product.url}/graphs/${outer.id}`);
  await saved(page);
  await expect(problems(page)).toHaveCount(0);
  const edit = (seq: number, exits: boolean) =>
    product.ask<{ seq: number }>(
      `/api/graphs/${inner.id}/umrf?seq=${seq}`,
      sends("PUT", fileOf("Fetch", "Step", exits)),
    );
  const { seq } = await edit(inner.seq, false);
  await expect(problems(page).first()).toBeVisible({ timeout: 20_000 });
  await edit(seq, true);
  await expect(problems(page)).toHaveCount(0, { timeout: 20_000 });

  await page.getByRole("button", { name: "Choose where to start" }).click();
  const dialog = page.getByRole("dialog");
  const begin = dialog.getByRole("button", { name: /^Run v1 in / });
  await expect(begin).toBeEnabled({ timeout: 15_000 });
  await begin.focus();
  await page.keyboard.down("Enter");
  await expect(dialog).toBeHidden();
  await page.keyboard.up("Enter");
  const path = `/api/runs?graph=${outer.id}&state=finished`;
  await expect
    .poll(async () => (await product.ask<object[]>(path, {}, product.runnerUrl)).length)
    .toBe(1);
  const [run] = await product.ask<{ id: string }[]>(path, {}, product.runnerUrl);
  const whole = await product.ask<{ actions: object; subgraphs: { name: string }[] }>(
    `/api/runs/${run?.id}`,
    {},
    product.runnerUrl,
  );
  expect(Object.keys(whole.actions)).toContain("Task__Fetch__0/Step_0");
  expect(whole.subgraphs.map(({ name }) => name)).toEqual(["Fetch"]);
});
