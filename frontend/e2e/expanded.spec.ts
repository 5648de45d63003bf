/** Graphs expanded in place: on the canvas, in the outline, in searches, while they run, and on a phone. */
import { expect, type Page, test } from "@playwright/test";
import { add as addAction, boxOf, saved, start } from "./canvas";
import { LONG, type Person, Product } from "./product";
import { post, violations } from "./valves";

const product = new Product();
let ada: Person;
const ids: Record<string, string> = {};

const named = (name: string) => ({ name, instance_id: 0 });
const on = ["on_true -> run", "on_false -> run", "on_error -> run", "on_stopped -> ignore"];

/** Actions one after the other. */
function line(graph: string, names: readonly string[]) {
  const tie = (name: string | undefined) =>
    name === undefined ? [] : [{ ...named(name), conditions: on }];
  return {
    graph_name: graph,
    graph_entry: [named(names[0] ?? "")],
    graph_exit: tie(names.at(-1)),
    actions: names.map((name, i) => ({
      ...named(name),
      type: "sync",
      gui_attributes: { position: { x: i * 300, y: 0 } },
      parents: tie(names[i - 1]),
      children: tie(names[i + 1]),
    })),
  };
}

test.skip(LONG !== "", LONG);
test.describe.configure({ mode: "serial" });
test.beforeAll(async ({ browser }) => {
  await product.start();
  for (const [graph, names] of [
    ["Grip", ["OpenHand", "CloseFingers"]],
    ["Fetch", ["Look", "Grip"]],
    ["Round", ["Drive", "Fetch", "Say"]],
  ] as const)
    ids[graph] = (await post<{ id: string }>(product, "/api/graphs", line(graph, names))).id;
  ada = await product.person(browser, "Ada");
  await ada.page.goto(`${product.url}/graphs/${ids.Round}`);
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

/** The card of an action of the graph that is on the canvas. */
const outer = (page: Page, name: string) =>
  page.locator(`.react-flow__node-action[aria-label^="${name} 0"]`);
const frame = (page: Page, name: string) =>
  page.getByRole("group", { name: `Graph inside ${name}` });
/** The card of an action on one of the frames. */
const inner = (page: Page, name: string) => page.locator(`[data-inner][data-name="${name}"]`);
const umrf = () => product.ask(`/api/graphs/${ids.Round}/umrf?identities=true`);

test("what is expanded has room, and nothing of it is an edit", async () => {
  const { page } = ada;
  const before = await umrf();
  const stood = await boxOf(outer(page, "Say"));
  await page.getByRole("button", { name: "Expand the graph inside Fetch" }).click();
  await expect(inner(page, "Look")).toBeVisible();
  await expect(inner(page, "Grip")).toBeVisible();
  await expect
    .poll(async () => {
      const [fetch, say] = [await boxOf(outer(page, "Fetch")), await boxOf(outer(page, "Say"))];
      return say.x > fetch.x + fetch.width && fetch.width > 2 * stood.width;
    })
    .toBe(true);
  await page.getByRole("button", { name: "Expand the graph inside Grip" }).click();
  await expect(inner(page, "CloseFingers")).toBeVisible();
  await expect(frame(page, "Grip")).toContainText("2 actions");
  expect(await violations(page)).toEqual([]);
  await page.reload();
  await expect(inner(page, "CloseFingers")).toBeVisible();
  expect(await umrf()).toEqual(before);
});

test("a card is moved beside what is expanded, and stands there once it is collapsed", async () => {
  const { page } = ada;
  const places = async () => {
    const { actions } = (await umrf()) as {
      actions: { name: string; gui_attributes: { position: { x: number; y: number } } }[];
    };
    return new Map(actions.map(({ name, gui_attributes }) => [name, gui_attributes.position]));
  };
  const before = await places();
  await page.keyboard.press("f");
  const { x, y, width, height } = await boxOf(outer(page, "Say"));
  const zoom = width / 208;
  await page.mouse.move(x + width / 2, y + height / 3);
  await page.mouse.down();
  await page.mouse.move(x + width / 2, y + height / 3 + 4); // as a hand begins
  await page.mouse.move(x + width / 2, y + height / 3 + 80 * zoom, { steps: 4 });
  await page.mouse.up();
  await saved(page);
  await expect.poll(async () => (await places()).get("Say")?.y).not.toBe(before.get("Say")?.y);
  const after = await places();
  expect(after.get("Fetch")).toEqual(before.get("Fetch"));
  expect(after.get("Drive")).toEqual(before.get("Drive"));
  const moved = await boxOf(outer(page, "Say"));
  expect(Math.abs(moved.x - x)).toBeLessThan(12);
  expect(Math.abs(moved.y - y - 80 * zoom)).toBeLessThan(12);
});

test("from afar a card is one thing to press, beside the one sign that is left", async () => {
  const { page } = ada;
  await page.keyboard.press("{");
  await page.keyboard.press("f");
  await page.keyboard.press("-");
  await page.keyboard.press("-");
  const fetch = outer(page, "Fetch");
  const { x, y, width } = await boxOf(fetch);
  expect(width / 208).toBeLessThan(0.9);
  await expect(fetch.getByRole("button", { name: "Expand the graph inside Fetch" })).toBeHidden();
  const sign = await boxOf(fetch.getByRole("button", { name: "Open the graph inside Fetch" }));
  expect(Math.min(sign.width, sign.height)).toBeGreaterThan(16);
  for (const right of [4, 12, 28].map((beside) => x + width - sign.x + beside)) {
    await page.keyboard.press("Escape");
    await expect(fetch).not.toHaveClass(/\bselected\b/);
    await page.mouse.click(x + width - right, y + 12);
    await expect(fetch).toHaveClass(/\bselected\b/);
  }
  await expect(inner(page, "Look")).toHaveCount(0);
});

test("keys expand and collapse, the outline and the search reach inside", async () => {
  const { page } = ada;
  await page.keyboard.press("{");
  await expect(inner(page, "Look")).toHaveCount(0);
  await outer(page, "Fetch").click();
  await page.keyboard.press("}");
  await expect(inner(page, "Look")).toBeVisible();
  await page.keyboard.press("Control+k");
  await page.keyboard.type("one level more");
  await page.keyboard.press("Enter");
  await expect(inner(page, "CloseFingers")).toBeVisible();

  await page.getByRole("radiogroup", { name: "List" }).or(page.getByText("Outline")).last().click();
  const row = page.getByRole("treegrid").getByRole("row", { name: "CloseFingers 0" });
  await expect(row).toHaveAttribute("aria-level", "3");
  await page.keyboard.press("Control+f");
  await page.getByRole("combobox", { name: "Find in graph" }).fill("closef");
  await expect(page.getByRole("option")).toContainText("in Fetch › Grip");
  await page.keyboard.press("Escape");
  await row.focus();
  await page.keyboard.press("Enter");
  await expect(page.getByRole("navigation", { name: "Where you are" })).toContainText(
    "Graphs/Round/Fetch/Grip",
  );
  await expect(outer(page, "CloseFingers")).toHaveClass(/\bselected\b/);
  await page.keyboard.press("[");
  await expect(outer(page, "Grip")).toHaveClass(/\bselected\b/);
  await page.keyboard.press("[");
  await expect(outer(page, "Fetch")).toHaveClass(/\bselected\b/);
  await expect(inner(page, "CloseFingers")).toBeVisible();
});

test("a dry-run and a run show their states on all levels", async () => {
  const { page } = ada;
  await page.getByRole("button", { name: "Dry-run", exact: true }).click();
  const bar = page.getByRole("region", { name: "Dry-run" });
  const moment = bar.getByRole("slider", { name: "Moment" });
  await expect(moment).toBeEnabled(); // worked out: before that it has no end
  await moment.press("End");
  await expect(inner(page, "CloseFingers")).toHaveAttribute("data-state", "true");
  await moment.press("Home");
  await expect(inner(page, "CloseFingers")).toHaveAttribute("data-state", "waits");
  await bar.getByRole("button", { name: "Close the dry-run" }).click();
  await saved(page);
  await start(page);
  await expect(inner(page, "OpenHand")).toHaveAttribute("data-state", "running");
  await expect(inner(page, "CloseFingers")).toHaveAttribute("data-state", "running");
  await expect(inner(page, "CloseFingers")).toHaveAttribute("data-state", "true");
});

test("what a colleague changes inside is seen where it is expanded", async ({ browser }) => {
  const mari = await product.person(browser, "Mari");
  await mari.page.goto(`${product.url}/graphs/${ids.Grip}`);
  await addAction(mari.page, "LetGo");
  await saved(mari.page);
  await expect(inner(ada.page, "LetGo")).toBeVisible({ timeout: 30_000 });
  expect(mari.failures).toEqual([]);
  await mari.context.close();
});

test("what a graph takes and gives elsewhere is set at the graph, with a word before it is many", async () => {
  const { page } = ada;
  const open = { pvf_type: "string" };
  const takes = { graph_name: "Take", graph_entry: [named("Reach")], graph_exit: [named("Reach")] };
  const reach = { ...named("Reach"), type: "sync", input_parameters: { place: open, from: open } };
  const body = { ...takes, actions: [reach] };
  const { id } = await post<{ id: string }>(product, "/api/graphs", body);
  for (const graph of ["First", "Second"])
    await post(product, "/api/graphs", line(graph, ["Take"]));
  await page.goto(`${product.url}/graphs/${id}`);
  await expect(page.getByRole("button", { name: "Used in 2 graphs" })).toBeVisible();
  const region = page.getByRole("region", { name: "Takes, inside of another graph" });
  await expect(region.getByRole("listitem")).toHaveCount(2);
  await region.getByRole("checkbox", { name: "required" }).last().uncheck();
  const word = page.getByRole("alert").filter({ hasText: "This graph runs inside 2 others" });
  await expect(word).toBeVisible();
  await saved(page);
  const { actions } = await product.ask<{ actions: { input_parameters: object }[] }>(
    `/api/graphs/${id}/umrf`,
  );
  expect(actions[0]?.input_parameters).toMatchObject({
    from: { pvf_required: false },
    place: open,
  });
  expect(await violations(page)).toEqual([]);
});

test("on a phone the outline expands, and leads into the level", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", {
    viewport: { width: 390, height: 780 },
    hasTouch: true,
    isMobile: true,
  });
  await page.goto(`${product.url}/graphs/${ids.Round}`);
  await page.getByText("Outline").first().tap();
  await page.getByRole("button", { name: "What to do with Fetch" }).tap();
  await page.getByRole("menuitem", { name: /Expand or collapse/ }).tap();
  const row = page.getByRole("row", { name: "Grip 0" });
  await expect(row).toHaveAttribute("aria-level", "2");
  expect(await violations(page)).toEqual([]);
  await row.getByRole("button").first().tap();
  await expect(page.getByRole("button", { name: "Out" })).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});
