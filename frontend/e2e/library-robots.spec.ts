/** What robots have beside the library: told apart, and taken over. */

import { expect, test } from "@playwright/test";
import { action, leaf, list, post, using } from "./library-actions";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("what a robot has is told apart from the library, and taken over", async ({ browser }) => {
  const robot = { method: "POST", body: JSON.stringify({ name: "atlas" }) };
  const headers = { "content-type": "application/json" };
  await product.ask("/api/robots", { ...robot, headers }, product.runnerUrl);
  const lift = await post(product, "/api/actions", action("LiftBox", { height: leaf("number") }));
  const { page, context, failures } = await product.person(browser, "Ada");
  const allowed = { "access-control-allow-origin": product.url };
  const credentials = { "access-control-allow-credentials": "true" };
  const has = (name: string, inputs: object) => ({ name, inputs, outputs: {} });
  const actions = [has("LiftBox", { height: "string" }), has("OnlyThere", { "at::x": "number" })];
  await page.route("**/api/robots/atlas/known", (route) =>
    route.fulfill({
      headers: { ...allowed, ...credentials },
      json: { actions, graphs: [], unread: 0 },
    }),
  );
  await page.route("**/api/robots/atlas/known/OnlyThere", (route) =>
    route.fulfill({
      headers: { ...allowed, ...credentials },
      json: action("OnlyThere", { at: { x: leaf("number") } }),
    }),
  );
  await page.route("**/api/robots/atlas/known/LiftBox", (route) =>
    route.fulfill({
      headers: { ...allowed, ...credentials },
      json: action("LiftBox", { height: leaf("string", { pvf_value: "knee" }) }),
    }),
  );
  await page.goto(`${product.url}/actions`);
  await page.getByRole("button", { name: "On atlas" }).click();
  await expect(list(page).getByRole("link")).toHaveCount(2);
  await list(page)
    .getByRole("link", { name: /LiftBox/ })
    .click();
  const robots = page.getByRole("list", { name: "Robots" });
  await expect(robots).toContainText("height is string");

  // What it would become is shown first, and somebody else's edit since then stops it.
  await robots.getByRole("button", { name: "Take over from atlas" }).click();
  const look = page.getByRole("dialog", { name: "Take over LiftBox from atlas" });
  const changes = look.getByRole("list", { name: "What would change" });
  await expect(changes.locator("ins").first()).toContainText("string");
  const patch = { method: "PATCH", body: JSON.stringify({ description: "lifts" }) };
  await product.ask(`/api/graphs/${lift.id}`, { ...patch, headers });
  await look.getByRole("button", { name: "Take over", exact: true }).click();
  await expect(look.getByRole("alert")).toContainText("Somebody has changed this action");
  await look.getByRole("button", { name: "Take over", exact: true }).click();
  await expect(look).toBeHidden();
  await expect(robots).toContainText("has it");
  await expect(page.getByRole("table", { name: "Takes" })).toContainText("knee");
  await page.getByRole("tab", { name: "History" }).click();
  await page
    .getByRole("button", { name: /^Restore/ })
    .first()
    .click();
  await expect(robots).toContainText("height is string");
  await list(page)
    .getByRole("link", { name: /OnlyThere/ })
    .click();
  await expect(page.getByRole("list", { name: "Robots" })).toContainText("has it");

  // The same from beside a canvas.
  await page.goto(`${product.url}/graphs/${await using(product, "boxes", action("Wait", {}))}`);
  const library = page.getByRole("complementary", { name: "Library" });
  await library.getByText("Actions", { exact: true }).click();
  await library.getByRole("button", { name: "Take over OnlyThere from atlas" }).click();
  await expect(library.getByText("Only on robots")).toHaveCount(0);
  await expect(library.getByRole("button", { name: /^OnlyThere/ })).toBeVisible();
  const known = await product.ask<{ name: string; document: string | null }[]>("/api/actions");
  expect(known.find(({ name }) => name === "OnlyThere")?.document).toBeTruthy();
  expect(failures).toEqual([]);
  await context.close();
});
