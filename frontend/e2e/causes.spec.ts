/** Five runs that failed in five ways: the page names the cause of each, and shows where. */

import { expect, test } from "@playwright/test";
import { card } from "./canvas";
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

/** The graph, the cause in words, the action that it shows at, and what its card says there. */
const FAILURES = [
  ["pack_order", 'Grip was started with speed = "fast": a number was expected.', "Grip", "error"],
  ["search_shelf", "Search is not known to Robin, so it refused the graph.", "Search", "waits"],
  ["photo_round", "Join waits for Look, which never reported its end.", "Join", "waits"],
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
