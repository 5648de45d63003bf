/** The outline and search by keyboard alone, comments between two people. */

import { expect, type Page, test } from "@playwright/test";
import { CARD, card, pick, saved, start, umrfOf } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

async function example(page: Page, name: string): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  const id = graphs.find((graph) => graph.name === name)?.id ?? "";
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  return id;
}

const row = (page: Page) => page.locator('[role="treegrid"] tr:focus');

test("a graph is drawn in the outline by keyboard alone", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    body: JSON.stringify({ name: "by_keyboard" }),
    headers: { "content-type": "application/json" },
  });
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  for (const name of ["Spot", "Take"]) {
    await page.keyboard.press("a");
    await page.keyboard.type(name);
    await page.keyboard.press("Enter");
    await expect(card(page, name)).toBeVisible();
  }
  await page.keyboard.press("o");
  await expect(row(page)).toContainText("Take"); // what was added last is selected
  await page.keyboard.press("Home");
  await expect(row(page)).toContainText("Entry");

  // Start with Spot.
  await page.keyboard.press("c");
  await page.keyboard.type("Spot");
  await expect(page.getByRole("option", { name: "Spot" })).toBeVisible();
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  await expect(row(page)).toContainText("Entry");

  // From Spot, when true, Take.
  const go = async (words: RegExp) => {
    await page.keyboard.press("Home");
    for (let i = 0; i < 12 && !words.test((await row(page).textContent()) ?? ""); i += 1) {
      await page.keyboard.press("ArrowDown");
    }
    await expect(row(page)).toContainText(words);
  };
  await go(/^Spot 0/);
  await page.keyboard.press("c");
  await expect(page.getByRole("combobox", { name: "Run", exact: true })).toBeFocused();
  await page.keyboard.type("Take");
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  await expect(page.getByRole("row", { name: /run Take/ })).toBeVisible();

  // Another response, another name, and back.
  await go(/^run Take/);
  await page.keyboard.press("r");
  const stop = page.getByRole("option", { name: "stop", exact: true });
  await stop.waitFor();
  for (let i = 0; i < 6; i += 1) {
    if ((await stop.getAttribute("data-combobox-selected")) !== null) break;
    await page.keyboard.press("ArrowDown");
  }
  await page.keyboard.press("Enter");
  await expect(page.getByRole("row", { name: /stop Take/ })).toBeVisible();
  await go(/^Take 0/);
  await page.keyboard.press("F2");
  await page.keyboard.type("Catch");
  await page.keyboard.press("Enter");
  await expect(card(page, "Catch")).toBeVisible();
  await page.keyboard.press("Delete");
  await expect(card(page, "Catch")).toHaveCount(0);
  await page.keyboard.press("ControlOrMeta+z");
  await expect(card(page, "Catch")).toBeVisible();

  // A note stands in the outline too, and is written there.
  await page.keyboard.press("n");
  await page.keyboard.type("Mind the step");
  await page.keyboard.press("Escape");
  await page.keyboard.press("o");
  await expect(row(page)).toContainText("Mind the step");
  await page.keyboard.press("F2");
  await expect(page.getByRole("textbox", { name: "Text of the note" })).toBeFocused();
  await page.keyboard.press("ControlOrMeta+a");
  await page.keyboard.type("Mind the gap");
  await page.keyboard.press("Enter");
  await expect(page.getByRole("group", { name: "Note, amber: Mind the gap" })).toBeVisible();
  await saved(page);
  const { actions } = await product.ask<{ actions: { name: string; parents?: object[] }[] }>(
    `/api/graphs/${id}/umrf`,
  );
  expect(actions[1]).toMatchObject({
    name: "Catch",
    parents: [{ name: "Spot", conditions: expect.arrayContaining(["on_true -> stop"]) }],
  });
  expect(failures).toEqual([]);
  await context.close();
});

test("hits are stepped through by keyboard and shown on the canvas; one robot stands out", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await example(page, "morning_round");
  await page.keyboard.press("ControlOrMeta+f");
  const field = page.getByRole("combobox", { name: "Find in graph" });
  await expect(field).toBeFocused();
  await page.keyboard.type("DriveTo");
  const count = page.getByRole("status").filter({ hasText: / of / });
  await expect(count).toHaveText(/^1 of \d+/);
  await page.keyboard.press("Enter");
  const first = page.locator(".react-flow__node-action.selected");
  await expect(first).toHaveCount(1);
  await page.keyboard.press("Enter");
  await expect(count).toHaveText(/^2 of \d+/);
  await page.keyboard.press("Shift+Enter");
  await expect(count).toHaveText(/^1 of \d+/);
  await field.fill("type:nothing_is_of_this");
  await expect(page.getByText("Nothing matches.")).toBeVisible();
  await page.keyboard.press("Escape");
  await expect(field).toHaveCount(0);

  const robots = page.getByRole("group", { name: "Show the actions of one robot" });
  if ((await robots.count()) > 0) {
    const button = robots.getByRole("button").first();
    await button.click();
    await expect(button).toHaveAttribute("aria-pressed", "true");
    await expect(page.locator("[data-dim]").first()).toBeAttached();
  }
  expect(failures).toEqual([]);
  await context.close();
});

test("a frame folds to a block that says how its actions are, for one person on one device", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(4);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await pick(page, ["Wait", 1], ["Wait", 2]);
  await page.keyboard.press("Shift+F");
  const title = page.getByRole("textbox", { name: "Title of the frame" });
  await title.fill("Middle");
  await title.press("Enter");
  await saved(page);
  const { seq: before } = await product.ask<{ seq: number }>(`/api/graphs/${id}`);

  // By the button in its title; the keyboard stays at the frame, and B unfolds and folds it.
  const cards = page.locator(CARD);
  const toggle = page.getByRole("button", { name: "Contents of Middle" });
  const block = page.getByRole("group", { name: /^Frame, blue, folded: Middle/ });
  await expect(toggle).toHaveAttribute("aria-expanded", "true");
  await toggle.click();
  await expect(block).toBeFocused();
  await expect(block).toContainText("2 actions");
  await expect(toggle).toHaveAttribute("aria-expanded", "false");
  await expect(cards).toHaveCount(2);
  const from = (i: number) => page.locator(`[aria-label^="Arrow from Wait ${i}"]`);
  await expect(from(1)).toHaveCount(0);
  await expect(from(0)).not.toHaveCount(0);
  await expect(from(2)).not.toHaveCount(0);
  await page.keyboard.press("b");
  await expect(cards).toHaveCount(4);
  await page.keyboard.press("b");
  await expect(cards).toHaveCount(2);

  // A colleague sees all of it, nothing was written, and this device remembers.
  const mari = await product.person(browser, "Mari");
  await mari.page.goto(`${product.url}/graphs/${id}`);
  await expect(mari.page.locator(CARD)).toHaveCount(4);
  await page.reload();
  await saved(page);
  await expect(block).toContainText("2 actions");
  await expect(cards).toHaveCount(2);
  expect((await product.ask<{ seq: number }>(`/api/graphs/${id}`)).seq).toBe(before);

  // What leads into it unfolds it; two clicks unfold it, too.
  await page.keyboard.press("ControlOrMeta+f");
  await page.getByRole("combobox", { name: "Find in graph" }).fill("Wait 2");
  await expect(page.getByRole("status").filter({ hasText: / of / })).toHaveText(/^1 of/);
  await page.keyboard.press("Enter");
  await expect(card(page, "Wait", 2)).toBeVisible();
  await expect(cards).toHaveCount(4);
  await page.keyboard.press("Escape");
  await toggle.click();
  await block.getByText("2 actions").dblclick();
  await expect(cards).toHaveCount(4);
  await toggle.click();

  // What is folded moves with its block, which is as much of it as there is to delete.
  const height = async () => {
    const { actions } = await umrfOf(product, id);
    return actions.find(({ instance_id: i }) => i === 1)?.gui_attributes?.position?.y ?? 0;
  };
  const stood = await height();
  await page.keyboard.press("Shift+ArrowDown");
  await expect.poll(height).toBe(stood + 32);
  await page.keyboard.press("Delete");
  await expect(cards).toHaveCount(4);
  await page.keyboard.press("ControlOrMeta+z");
  await expect(cards).toHaveCount(2);
  await saved(page);
  await start(page);
  await expect(block).toContainText("2 done", { timeout: 30_000 });
  expect([...failures, ...mari.failures]).toEqual([]);
  await mari.context.close();
  await context.close();
});

test("a comment is answered by somebody else, escaped, counted on the card, and resolved", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const ada = await product.person(browser, "Ada");
  const mari = await product.person(browser, "<b>Mari</b>");
  const id = await example(ada.page, "search_aisles");
  await mari.page.goto(`${product.url}/graphs/${id}`);
  await saved(mari.page);
  const [{ name }] = (await product.ask<{ actions: [{ name: string }] }>(`/api/graphs/${id}/umrf`))
    .actions;

  await card(ada.page, name)
    .first()
    .click({ position: { x: 50, y: 30 } });
  await ada.page.keyboard.press("m");
  await ada.page.getByRole("textbox", { name: /^Comment on/ }).fill("<img src=x onerror=alert(1)>");
  await ada.page.keyboard.press("ControlOrMeta+Enter");
  await expect(card(mari.page, name).first().getByTitle("Open comments")).toHaveText(/^ ?1/);

  await mari.page.getByRole("tab", { name: /Comments, 1 open/ }).click();
  await expect(mari.page.getByText("<img src=x onerror=alert(1)>")).toBeVisible();
  await mari.page.getByRole("button", { name: "Answer" }).click();
  await mari.page.getByRole("textbox", { name: "Answer" }).fill("No.");
  await mari.page.getByRole("button", { name: "Answer" }).click();
  await expect(ada.page.getByText("<b>Mari</b>").first()).toBeVisible();
  await expect(ada.page.getByText("No.", { exact: true })).toBeVisible();

  await ada.page.getByRole("button", { name: "Resolve" }).click();
  await expect(card(mari.page, name).first().getByTitle("Open comments")).toHaveCount(0);
  await mari.page.getByRole("button", { name: "Show 1 resolved" }).click();
  await expect(mari.page.getByRole("button", { name: "Open again" })).toBeVisible();
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await ada.context.close();
  await mari.context.close();
});
