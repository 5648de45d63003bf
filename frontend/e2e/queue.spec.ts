/** The queue on a phone: why each start waits, the look before one is started, and what a Stop does to it. */
import { expect, type Page, test } from "@playwright/test";
import { type Person, Product } from "./product";

test.describe.configure({ mode: "serial" });

const product = new Product();
let ann: Person;

function post<T>(path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method: "POST", body: JSON.stringify(body), headers }, base);
}

/** Put a start of a graph in the simulator into the queue. */
async function enter(name: string): Promise<void> {
  const end = [{ name: "Work", instance_id: 0 }];
  const actions = [{ name: "Work", instance_id: 0, type: "sync", parents: [], children: [] }];
  const file = { graph_name: name, graph_entry: end, graph_exit: end, actions };
  const { id } = await post<{ id: string }>("/api/graphs", file, product.url);
  const version = await post<{ id: string; digest: string; umrf: object }>(
    `/api/graphs/${id}/versions`,
    {},
    product.url,
  );
  const { digest, umrf } = version;
  const start = { version: version.id, digest, umrf, graph: id, engine: "simulator" };
  const script = { behaviours: { "*": [{ after_s: 0.5 }] } };
  await post("/api/queue", { start: { ...start, request_id: name, script } });
}

const line = (page: Page, name: string) => page.getByRole("listitem").filter({ hasText: name });

test.beforeAll(async ({ browser }) => {
  await product.start();
  ann = await product.person(browser, "Ann");
  await ann.page.setViewportSize({ width: 390, height: 844 });
});

test.afterAll(async () => {
  expect(ann.failures).toEqual([]);
  await ann.context.close();
  await product.dispose();
});

test("what waits says why, is moved, closed by a Stop, opened after a look, and started", async () => {
  const { page } = ann;
  await page.goto(`${product.url}/runs`);
  await expect(page.getByRole("link", { name: /in the queue/ })).toBeHidden();
  await enter("lift");
  await enter("drive");
  await page.getByRole("link", { name: "2 starts in the queue" }).click();
  await expect(line(page, "lift")).toContainText("a person looks, and starts it");
  await expect(line(page, "drive")).toContainText("It is behind 1 other for the simulator.");
  await line(page, "drive").getByRole("button", { name: "Move up" }).click();
  await expect(page.getByRole("listitem").first()).toContainText("drive");
  await post("/api/stop", {});
  const closed = page.getByRole("region", { name: "The queue of the simulator" });
  await expect(closed).toContainText("pressed Stop of everything");
  await closed.getByRole("button", { name: "Look again, and open it" }).click();
  await expect(closed).toBeHidden();
  const turn = line(page, "drive").getByRole("region", { name: /^Before the start of/ });
  await turn.getByRole("button", { name: "Look before the start" }).click();
  await expect(turn).toContainText("passed");
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  expect(wide).toBeLessThanOrEqual(390);
  await turn.getByRole("button", { name: "Start drive in the simulator" }).click();
  await expect(page).toHaveURL(/\/runs\/(?!queue)/);
  await page.goto(`${product.url}/runs/queue`);
  await expect(page.getByRole("listitem")).not.toHaveCount(0);
  await line(page, "lift").getByRole("button", { name: "Remove" }).click();
  await expect(page.getByText("Nothing waits")).toBeVisible();
});
