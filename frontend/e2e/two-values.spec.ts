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

async function put(page: Page, text: string, name = "Look"): Promise<void> {
  await card(page, name).click({ position: { x: 50, y: 30 } });
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

/** The client ids of this page's documents are all below or above those of everybody else: whose value stands. */
async function clientIds(page: Page, from: number): Promise<void> {
  await page.addInitScript((base) => {
    const random = crypto.getRandomValues.bind(crypto);
    crypto.getRandomValues = <T extends ArrayBufferView | null>(array: T): T => {
      random(array as never);
      if (array instanceof Uint32Array && array.length === 1)
        array[0] = base + ((array[0] ?? 0) % 1_000_000);
      return array;
    };
  }, from);
}

/** Opens the choices by keys, and picks the other value than the one that stands. */
async function chooseOther(page: Page, field: string): Promise<void> {
  const open = page.getByRole("button", { name: "Choose", exact: true });
  await open.focus();
  await page.keyboard.press("Enter");
  const dialog = page.getByRole("dialog", { name: "Changed by you and by others" });
  const values = dialog.getByRole("radiogroup", { name: field });
  await expect(values.getByRole("radio", { disabled: true })).toHaveCount(0); // it has been read
  await values.getByRole("radio", { checked: true }).focus();
  await page.keyboard.press("ArrowDown");
}

test("who stayed is told what an edit from offline replaced, and both lists survive a reload and a closed tab", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  await clientIds(ada.page, 3_000_000_000);
  await clientIds(mari.page, 1_000);
  const graph = await newGraph("unseen-values");
  await enter(ada.page, graph);
  await add(ada.page, "Lift");
  await put(ada.page, "before", "Lift");
  await saved(ada.page);
  await enter(mari.page, graph);
  await ada.context.setOffline(true);
  await put(ada.page, "by Ada", "Lift");
  await expect(ada.page.getByText(/Offline with 1 change/i).first()).toBeVisible();
  await put(mari.page, "by Mari", "Lift");
  await saved(mari.page);
  // An edit that comes sooner may be one of the same moment.
  const written = await mari.page.evaluate(() => Date.now());
  await mari.page.waitForFunction((before) => Date.now() > before + 2_100, written);
  await ada.context.setOffline(false);
  await saved(ada.page);

  const now = async () => (await umrf(graph)).actions[0]?.description;
  const unseen = mari.page.getByText(/replaced something that you had changed/);
  await expect(unseen).toBeVisible();
  expect(await now()).toBe("by Ada");
  await mari.page.screenshot({ path: test.info().outputPath("unseen.png") });
  await mari.page.reload();
  await expect(unseen).toBeVisible();
  await chooseOther(mari.page, "Lift: Description");
  await mari.page.screenshot({ path: test.info().outputPath("unseen-choice.png") });
  await expect.poll(now).toBe("by Mari");
  await saved(mari.page);
  await mari.page.reload();
  await saved(mari.page);
  await expect(card(mari.page, "Lift")).toBeVisible();
  await expect(unseen).toHaveCount(0); // it was chosen

  await expect(ada.page.getByText(/others changed something that you changed/)).toBeVisible();
  await ada.page.close();
  const again = await ada.context.newPage();
  await again.goto(`${product.url}/graphs/${graph}`);
  await expect(again.getByText(/others changed something that you changed/)).toBeVisible();
  await chooseOther(again, "Lift: Description");
  await expect.poll(now).toBe("by Ada");
  await again.getByRole("button", { name: "Done" }).click();
  await expect(again.getByRole("button", { name: "Choose", exact: true })).toHaveCount(0);
  await again.reload();
  await saved(again);
  await expect(card(again, "Lift")).toBeVisible();
  await expect(again.getByRole("button", { name: "Choose", exact: true })).toHaveCount(0);
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await ada.context.close();
  await mari.context.close();
});

test("a value of others that the server had collected is read from the history", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  await clientIds(ada.page, 3_000_000_000);
  await clientIds(mari.page, 1_000);
  // The socket of Ada's page is dead for a while, and neither side has noticed. What she sends arrives later.
  let isDead = false;
  const held: (() => void)[] = [];
  const sockets: (() => void)[] = [];
  await ada.page.routeWebSocket(/\/room\?/, (socket) => {
    const server = socket.connectToServer();
    socket.onMessage((message) => {
      if (isDead) held.push(() => server.send(message));
      else server.send(message);
    });
    server.onMessage((message) => {
      if (!isDead) socket.send(message);
    });
    sockets.push(() => void socket.close({ code: 1012 }));
  });
  const graph = await newGraph("collected-value");
  await enter(ada.page, graph);
  await add(ada.page, "Turn");
  await put(ada.page, "before", "Turn");
  await saved(ada.page);
  await enter(mari.page, graph);
  const now = async () => (await umrf(graph)).actions[0]?.description;
  isDead = true;
  await put(ada.page, "by Ada", "Turn");
  await expect.poll(() => held.length).toBeGreaterThan(0);
  await put(mari.page, "by Mari", "Turn");
  await expect.poll(now).toBe("by Mari");
  for (const send of held.splice(0)) send();
  await expect.poll(now).toBe("by Ada");
  for (const close of sockets.splice(0)) close();
  isDead = false;
  await saved(ada.page);
  await expect(ada.page.getByText(/others changed something that you changed/)).toBeVisible();
  await chooseOther(ada.page, "Turn: Description");
  await expect.poll(now).toBe("by Mari");
  await ada.page.screenshot({ path: test.info().outputPath("collected.png") });
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await ada.context.close();
  await mari.context.close();
});

test("a value that lost at once is in the history, with its author and what stayed", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada", { loadsAhead: true });
  const mari = await product.person(browser, "Mari", { loadsAhead: true });
  await clientIds(ada.page, 1_000);
  await clientIds(mari.page, 3_000_000_000);
  const graph = await newGraph("lost-at-once");
  await enter(ada.page, graph);
  // A name of its own: one that another graph has is offered from there.
  await add(ada.page, "Peer");
  await saved(ada.page);
  await enter(mari.page, graph);
  await ada.context.setOffline(true);
  await put(ada.page, "left of the door", "Peer");
  await expect(ada.page.getByText(/Offline with 1 change/i).first()).toBeVisible();
  await put(mari.page, "right of the door", "Peer");
  await saved(mari.page);
  await ada.context.setOffline(false);
  await saved(ada.page);
  expect((await umrf(graph)).actions[0]?.description).toBe("right of the door");

  const { page } = mari;
  await page.keyboard.press("Escape");
  const listed = page.getByRole("radiogroup", { name: "What is listed" });
  await listed.getByRole("radio", { name: "History" }).focus();
  await page.keyboard.press("Space");
  const lost = page.getByRole("region", { name: "History" }).getByRole("listitem");
  await expect(lost.filter({ hasText: "overwritten at once" })).toContainText(
    /Ada.*set Peer description to left of the door, overwritten at once by right of the door/,
  );
  await page.screenshot({ path: test.info().outputPath("history.png") });
  await card(page, "Peer").click({ position: { x: 50, y: 30 } });
  const fields = page.getByRole("list", { name: "Who set what" }).getByRole("listitem");
  const set = fields.filter({ hasText: "description" }).getByRole("button").first();
  await expect(set).toContainText(/right of the door.*Mari/); // it stands, and is hers
  await set.focus();
  await page.keyboard.press("Enter");
  const row = page.getByRole("table", { name: "Values of description" }).getByRole("row");
  await expect(row.filter({ hasText: "left of the door" })).toContainText(
    /left of the door.*Ada.*overwritten at once by right of the door/,
  );
  await page.screenshot({ path: test.info().outputPath("values.png") });
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
