/** Five runs that failed in five ways: the page names the cause of each, and shows where. */

import { expect, test } from "@playwright/test";
import { card } from "./canvas";
import { LONG, type Person, Product } from "./product";

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

/** The graph, the cause in words, the action that it shows at, and what its card says there. */
const FAILURES = [
  ["pack_order", 'Grip was started with speed = "fast": a number was expected.', "Grip", "error"],
  ["search_shelf", "Search is not known to Robin, so it refused the graph.", "Search", "waits"],
  ["photo_round", "Ben pressed Stop while Look ran (93.4–94.6 s)", "Look", "running"],
  ["night_watch", "The engine of Robin was restarted; what happened after is unknown.", "", ""],
  ["inspect", "Somebody else started inspect on Robin; this run was ended by it.", "", ""],
] as const;

test("the examples come with one click, each with its cause in the list", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs`);
  await page.getByRole("button", { name: "Show five recorded runs that failed" }).click();
  const rows = page.getByRole("row").filter({ hasText: "Robin (simulated)" });
  await expect(rows).toHaveCount(5);
  await expect(async () => {
    await page.reload(); // sums of runs are made a moment after their end
    for (const [graph, cause] of FAILURES) {
      await expect(rows.filter({ hasText: graph })).toContainText(cause, { timeout: 500 });
    }
  }).toPass();
  await expect(rows.first().getByText("example", { exact: true })).toBeVisible();
});

for (const [graph, cause, action, word] of FAILURES) {
  test(`${graph}: its cause is named within three clicks, and shown`, async () => {
    const { page } = ada;
    await page.goto(`${product.url}/runs`);
    await page.getByRole("link", { name: new RegExp(graph) }).click();
    const why = page.getByRole("region", { name: "Why" });
    await expect(why.getByRole("listitem").first()).toContainText(cause);
    const moment = why.getByRole("button").first();
    await moment.click();
    if (action === "") return;
    await expect(page.getByText("as it was then")).toBeVisible();
    await expect(page).toHaveURL(/[?&]t=\d+.*action=/);
    await expect(card(page, action).getByText(word)).toBeVisible();
  });
}

const headers = { "content-type": "application/json" };

/** Starts the newest version in the simulator; the id of the run. */
async function started(graph: string): Promise<string> {
  const post = (body: object) => ({ method: "POST", headers, body: JSON.stringify(body) });
  const path = `/api/graphs/${graph}/versions`;
  const version = await product.ask<{ id: string; digest: string; umrf: object }>(path, post({}));
  const request_id = crypto.randomUUID();
  const order = { version: version.id, digest: version.digest, umrf: version.umrf, graph };
  const body = { ...order, engine: "simulator", request_id };
  return (await product.ask<{ id: string }>("/api/runs", post(body), product.runnerUrl)).id;
}

interface RunNow {
  state: string;
  actions: Record<string, { visits: { result: string | null }[] }>;
}

test("since when it fails is named: who, what, and the step that differs", async () => {
  test.skip(LONG !== "", LONG);
  const { page } = ada;
  const id = await product.chain(2);
  const now = (run: string) => product.ask<RunNow>(`/api/runs/${run}`, {}, product.runnerUrl);
  const good = await started(id);
  await expect(async () => expect((await now(good)).state).toBe("finished")).toPass();
  const umrf = `/api/graphs/${id}/umrf`;
  const text = JSON.stringify(await product.ask<object>(umrf));
  const broken = text.replace(/("parents".*?)on_true -> run/, "$1on_true -> ignore");
  expect(broken).not.toBe(text);
  await product.ask(`${umrf}?seq=1`, { method: "PUT", body: broken, headers });
  const run = await started(id);
  await expect(async () => {
    expect((await now(run)).actions.Wait_0?.visits[0]?.result).toBe("true");
  }).toPass();
  await product.ask(`/api/runs/${run}/stop`, { method: "POST" }, product.runnerUrl);
  await expect(async () => expect((await now(run)).state).toMatch(/stopped|halted/)).toPass();
  await page.goto(`${product.url}/runs/${run}`);
  await page.getByRole("button", { name: "Since when?" }).click();
  const dialog = page.getByRole("dialog", { name: "Since when?" });
  const place = dialog.getByRole("list", { name: "Where it goes another way" });
  await expect(place.getByRole("listitem").first()).toContainText(
    "from this edit on, the graph goes",
  );
  await expect(place).toContainText("Wait_0 → Wait_1");
  await expect(place).toContainText("Wait_1 is told to run");
  await expect(dialog).toContainText(/since run \d+, which went well/);
  await expect(place.getByRole("link", { name: "The graph then" })).toHaveAttribute(
    "href",
    `/graphs/${id}?at=2`,
  );
});
