/** Two people change the same while one is away, and much at once: nothing is lost, and both values are told. */

import { expect, type Page, test } from "@playwright/test";
import { add, card, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

interface Graph {
  readonly id: string;
}
interface Umrf {
  readonly actions: readonly { name: string; description?: string }[];
}

const umrf = (graph: string) => product.ask<Umrf>(`/api/graphs/${graph}/umrf`);

async function newGraph(name: string): Promise<string> {
  const body = JSON.stringify({ name });
  const headers = { "content-type": "application/json" };
  return (await product.ask<Graph>("/api/graphs", { method: "POST", body, headers })).id;
}

async function enter(page: Page, graph: string): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
}

const description = (page: Page) => page.getByRole("textbox", { name: "Description" });

async function put(page: Page, text: string): Promise<void> {
  await card(page, "Look").click({ position: { x: 50, y: 30 } });
  await description(page).fill(text);
  await page.keyboard.press("Tab");
}

test("who was away is told both values, chooses by keys, and takes it back without taking the other's", async ({
  browser,
}) => {
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  const graph = await newGraph("two-values");
  await enter(ada.page, graph);
  await add(ada.page, "Look");
  await put(ada.page, "before");
  await saved(ada.page);
  await enter(mari.page, graph);
  await ada.context.setOffline(true);
  await put(ada.page, "by Ada");
  await expect(ada.page.getByText(/Offline with 1 change/i).first()).toBeVisible();
  await put(mari.page, "by Mari");
  await saved(mari.page);
  await ada.context.setOffline(false);
  await saved(ada.page);

  const choose = ada.page.getByRole("button", { name: "Choose", exact: true });
  await expect(ada.page.getByText(/others changed something that you changed, too/)).toBeVisible();
  await ada.page.screenshot({ path: test.info().outputPath("notice.png") });
  await choose.focus();
  await ada.page.keyboard.press("Enter");
  const dialog = ada.page.getByRole("dialog", { name: "Changed by you and by others" });
  const field = dialog.getByRole("radiogroup", { name: "Look: Description" });
  const stands = await field.getByRole("radio", { checked: true }).getAttribute("value");
  const now = async () => (await umrf(graph)).actions[0]?.description;
  expect(await now()).toBe(stands === "mine" ? "by Ada" : "by Mari");
  await ada.page.screenshot({ path: test.info().outputPath("choice.png") });
  await field.getByRole("radio", { checked: true }).focus();
  await ada.page.keyboard.press("ArrowDown"); // from one to the other, whichever stands
  await expect.poll(now).toBe(stands === "mine" ? "by Mari" : "by Ada");
  await ada.page.keyboard.press("Tab");
  await dialog.getByRole("button", { name: "Done" }).focus();
  await ada.page.keyboard.press("Enter");
  await expect(dialog).toHaveCount(0);
  await expect(choose).toHaveCount(0);

  // Everything of Ada's is taken back: Mari's words stay, and so does the action with them.
  await card(ada.page, "Look").click({ position: { x: 50, y: 30 } });
  await ada.page.keyboard.press("Escape");
  for (let n = 0; n < 6; n += 1) await ada.page.keyboard.press("Control+z");
  await saved(ada.page);
  await expect.poll(now).toBe("by Mari");
  await expect(card(mari.page, "Look")).toBeVisible();
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await ada.context.close();
  await mari.context.close();
});

test("1,200 actions are deleted and brought back by keys, and the next edit is stored, also after a reload", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  test.setTimeout(240_000);
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const actions = Array.from({ length: 1_200 }, (_, n) => ({
    name: "Step",
    instance_id: n,
    type: "sync",
    gui_attributes: { position: { x: (n % 40) * 260, y: Math.floor(n / 40) * 160 } },
    description: `Step ${n} of a long task, with words as people write them. `.repeat(16),
    input_parameters: { speed: { pvf_type: "number", pvf_value: n } },
    children: n < 1_199 ? [{ name: "Step", instance_id: n + 1 }] : [],
  }));
  const { id } = await product.ask<Graph>("/api/graphs", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({ graph_name: "large", actions }),
  });
  await enter(ada.page, id);
  const count = async () => (await umrf(id)).actions.length;
  expect(await count()).toBe(1_200);
  await ada.page.locator(".react-flow__pane").click({ position: { x: 20, y: 200 } });
  await ada.page.keyboard.press("Control+a");
  await ada.page.keyboard.press("Delete");
  await expect.poll(count, { timeout: 30_000 }).toBe(0);
  await ada.page.keyboard.press("Control+z");
  await expect.poll(count, { timeout: 60_000 }).toBe(1_200);
  const settled = () =>
    expect(ada.page.getByText("Saved", { exact: true })).toBeVisible({ timeout: 60_000 });
  await settled();
  await ada.page.reload();
  await settled();
  await add(ada.page, "Next");
  await settled();
  await expect.poll(count, { timeout: 60_000 }).toBe(1_201);
  expect(ada.failures).toEqual([]);
  await ada.context.close();
});
