/** Drawing with a mouse: pieces travel, arrows are led, things are put in their place. */

import { expect, type Locator, type Page, test } from "@playwright/test";
import {
  add,
  arrows,
  boxOf,
  CARD,
  card,
  chosen,
  connect,
  enter,
  meaningOf,
  meant,
  pick,
  saved,
  tidy,
  umrfOf,
} from "./canvas";
import { LONG, Product } from "./product";
import { fetching } from "./task-graphs";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const cards = (page: Page) => page.locator(CARD);

/** Chooses an edit action by its name in the palette. */
async function choose(page: Page, name: string): Promise<void> {
  test.skip(LONG !== "", LONG);
  await page.keyboard.press("ControlOrMeta+k");
  const search = page.getByRole("combobox", { name: "Find a command, an action or a graph" });
  await search.fill(name);
  await expect(page.getByRole("option").first()).toContainText(name);
  await search.press("Enter");
  await expect(search).toBeHidden();
}

/** Takes one end of an arrow and drops it on something, or on empty canvas. */
async function lead(
  page: Page,
  arrow: string,
  end: "source" | "target",
  to: Locator | null,
): Promise<void> {
  const anchor = page.locator(
    `[aria-label^="Arrow from ${arrow}"] .react-flow__edgeupdater-${end}`,
  );
  const [from, box] = [await boxOf(anchor), to && (await boxOf(to))];
  const goal = box
    ? ([box.x + box.width / 2, box.y + box.height / 2] as const)
    : ([from.x + 260, from.y + 40] as const);
  await page.mouse.move(from.x + from.width / 2, from.y + from.height / 2);
  await page.mouse.down();
  await page.mouse.move(goal[0] - 30, goal[1] + 4, { steps: 6 });
  await page.mouse.move(...goal, { steps: 4 });
  await page.mouse.up();
}

const places = async (page: Page, id: string) => {
  await saved(page);
  const { actions } = await umrfOf(product, id);
  return new Map(
    actions.map((action) => [
      `${action.name} ${action.instance_id}`,
      action.gui_attributes?.position ?? { x: 0, y: 0 },
    ]),
  );
};

test("pieces are copied with their arrows, here, to another graph, and as text", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);

  await pick(page, ["Wait", 0], ["Wait", 1]);
  await page.keyboard.press("ControlOrMeta+c");
  await page.keyboard.press("ControlOrMeta+v");
  await expect(cards(page)).toHaveCount(5);
  await expect(chosen(page)).toHaveCount(2);
  await expect.poll(() => arrows(product, id)).toContain("Wait_3 > Wait_4");
  // One step of undo.
  await page.keyboard.press("ControlOrMeta+z");
  await expect(cards(page)).toHaveCount(3);

  // Duplicated, also with the arrow inside; and cut away again.
  await pick(page, ["Wait", 1], ["Wait", 2]);
  await page.keyboard.press("ControlOrMeta+d");
  await expect(cards(page)).toHaveCount(5);
  await page.keyboard.press("ControlOrMeta+x");
  await expect(cards(page)).toHaveCount(3);

  // To another graph, in another tab, where what was cut has arrows as before.
  const other = await product.chain(1);
  const tab = await context.newPage();
  await tab.goto(`${product.url}/graphs/${other}`);
  await saved(tab);
  await tab.keyboard.press("ControlOrMeta+v");
  await expect(cards(tab)).toHaveCount(3);
  await saved(tab);
  await expect.poll(() => arrows(product, other)).toContain("Wait_3 > Wait_4");

  // As text: what the clipboard has is UMRF, and UMRF of any dialect can be pasted.
  const paste = (text: string) =>
    tab.evaluate((given) => {
      const data = new DataTransfer();
      data.setData("text/plain", given);
      window.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true }));
    }, text);
  await paste('{"graph_name": "x", "actions": [{"name": "Beep", "instance_id": 0, "id": 0}]}');
  await expect(card(tab, "Beep")).toBeVisible();
  await paste('{"actions": [,]}');
  await expect(tab.getByRole("alert").filter({ hasText: "Nothing pasted" })).toContainText(
    "line 1",
  );
  expect(failures).toEqual([]);
  await context.close();
});

test("arrows: healed, filled, led elsewhere, drawn by two taps", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);

  await pick(page, ["Wait", 1]);
  await page.keyboard.press("ControlOrMeta+Backspace");
  await expect(cards(page)).toHaveCount(2);
  await expect
    .poll(() => arrows(product, id))
    .toEqual(["Wait_0 > Wait_2", "Wait_2 > exit", "entry > Wait_0"]);

  // An action dropped onto the arrow goes into it.
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  const [before, behind] = [card(page, "Wait", 0), card(page, "Wait", 2)];
  const gap = async () => {
    const [a, b] = [await boxOf(before), await boxOf(behind)];
    return { x: a.x + a.width + (b.x - a.x - a.width) * 0.75, y: b.y + b.height / 2 };
  };
  const library = page.getByRole("complementary", { name: "Library" });
  await library.getByText("Actions", { exact: true }).click();
  const row = library.getByRole("button", { name: /^CheckBattery/ });
  await row.hover();
  await page.mouse.down();
  const at = await gap();
  await page.mouse.move(at.x, at.y - 30, { steps: 6 });
  await page.mouse.move(at.x, at.y, { steps: 4 });
  await page.mouse.up();
  await expect
    .poll(() => arrows(product, id))
    .toEqual([
      "CheckBattery_0 > Wait_2",
      "Wait_0 > CheckBattery_0",
      "Wait_2 > exit",
      "entry > Wait_0",
    ]);

  // Two taps: an outcome, then what follows.
  await page.keyboard.press("Escape");
  await tidy(page);
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await card(page, "Wait", 2).getByLabel("When error", { exact: true }).click();
  await expect(page.getByRole("status").filter({ hasText: "tap what follows" })).toBeVisible();
  await card(page, "Wait", 0).click({ position: { x: 60, y: 12 } });
  await expect.poll(() => arrows(product, id)).toContain("Wait_2 > Wait_0");
  const relation = (await umrfOf(product, id)).actions
    .find((action) => action.name === "Wait" && action.instance_id === 0)
    ?.parents?.find((parent) => parent.instance_id === 2);
  expect(relation?.conditions).toEqual([
    "on_true -> ignore",
    "on_false -> ignore",
    "on_error -> run",
    "on_stopped -> ignore",
  ]);

  // It is chosen now: led elsewhere with all that it says.
  await choose(page, "Lead the arrow elsewhere");
  await page.getByRole("combobox", { name: "To", exact: true }).fill("check");
  await page.keyboard.press("Enter");
  await expect.poll(() => arrows(product, id)).toContain("Wait_2 > CheckBattery_0");

  // Its ends are taken with the mouse: to another card, after another outcome, and nowhere.
  await lead(page, "Wait 2, when error: run CheckBattery 0", "target", card(page, "Wait", 0));
  await expect.poll(() => arrows(product, id)).toContain("Wait_2 > Wait_0");
  expect(await arrows(product, id)).not.toContain("Wait_2 > CheckBattery_0");
  await lead(page, "Wait 2, when error: run Wait 0", "source", card(page, "CheckBattery"));
  await expect.poll(() => arrows(product, id)).toContain("CheckBattery_0 > Wait_0");
  const led = await arrows(product, id);
  expect(led).not.toContain("Wait_2 > Wait_0");
  await lead(page, "CheckBattery 0, when error: run Wait 0", "target", null);
  await expect(page.getByRole("combobox", { name: "Name of an action" })).toBeHidden();
  const ok = card(page, "CheckBattery").getByLabel("When stopped", { exact: true });
  await lead(page, "CheckBattery 0, when error: run Wait 0", "source", ok);
  await expect(page.getByLabel(/^Arrow from CheckBattery 0, when stopped: run/)).toBeAttached();
  expect(await arrows(product, id)).toEqual(led);
  expect(failures).toEqual([]);
  await context.close();
});

test("things are put in their place: aligned, spread, tidied, nudged, framed, noted", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(4);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  const all: [string, number][] = [0, 1, 2].map((i) => ["Wait", i]);

  // Nudges in a row are one step of undo.
  await pick(page, ["Wait", 1]);
  const stood = (await places(page, id)).get("Wait 1")?.y ?? 0;
  for (let i = 0; i < 3; i += 1) await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Shift+ArrowDown");
  await expect.poll(async () => ((await places(page, id)).get("Wait 1")?.y ?? 0) - stood).toBe(56);
  await page.keyboard.press("Shift+ArrowRight");
  await page.keyboard.press("Shift+ArrowRight");

  await pick(page, ...all);
  await choose(page, "Align top");
  let at = await places(page, id);
  expect(new Set(all.map(([name, i]) => at.get(`${name} ${i}`)?.y)).size).toBe(1);
  await choose(page, "Distribute across");
  at = await places(page, id);
  const [a = 0, b = 0, c = 0] = all.map(([name, i]) => at.get(`${name} ${i}`)?.x);
  expect(Math.abs(b - a - (c - b))).toBeLessThanOrEqual(1);

  // A frame round them takes them along; a note is plain text.
  await choose(page, "Draw a frame");
  const title = page.getByRole("textbox", { name: "Title of the frame" });
  await title.fill("Wait <b>here</b>");
  await title.press("Enter");
  const frame = page.getByRole("group", { name: "Frame, blue: Wait <b>here</b>" });
  await expect(frame).toBeVisible();
  const before = await places(page, id);
  await frame.getByText("Wait <b>here</b>").click();
  await page.keyboard.press("Shift+ArrowLeft");
  await expect
    .poll(async () => (await places(page, id)).get("Wait 2")?.x)
    .toBe((before.get("Wait 2")?.x ?? 0) - 32);
  expect((await places(page, id)).get("Wait 3")).toEqual(before.get("Wait 3"));
  await page.getByRole("button", { name: "violet" }).click();
  await expect(page.getByRole("group", { name: /^Frame, violet/ })).toBeVisible();

  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Write a note" }).click();
  const text = page.getByRole("textbox", { name: "Text of the note" });
  await text.fill("=1+1 <script>");
  await text.press("Escape");
  await expect(page.getByRole("group", { name: "Note, amber: =1+1 <script>" })).toBeVisible();
  // It has a form too.
  const form = page.getByRole("tabpanel", { name: "Note" });
  await form.getByText("green", { exact: true }).click();
  await form.getByRole("textbox", { name: "Width" }).fill("20");
  await expect(form.getByText("A whole number from 60 to 20000.")).toBeVisible();
  await form.getByRole("textbox", { name: "Width" }).fill("300");
  await page.keyboard.press("Enter");
  const note = page.getByRole("group", { name: "Note, green: =1+1 <script>" });
  await expect(note).toHaveCSS("width", "300px");

  // The pictures have it all, escaped.
  const download = page.waitForEvent("download");
  await choose(page, "Export as SVG");
  const file = await (await download).createReadStream();
  let svg = "";
  for await (const chunk of file) svg += String(chunk);
  expect(svg).toContain("Wait &lt;b&gt;here&lt;/b&gt;");
  expect(svg).not.toContain("<script");
  expect(svg.match(/stroke-width="1.6"/g)).toHaveLength(16); // four outcomes each
  const png = page.waitForEvent("download");
  await choose(page, "Export as PNG");
  expect((await png).suggestedFilename()).toBe("chain_4.png");
  expect(failures).toEqual([]);
  await context.close();
});

test("a decision that is led to the end ends either way, and what runs beside it is waited for", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1) ?? "";
  await add(page, "Ask");
  await enter(page, "Ask");
  for (const [outcome, next, dy] of [
    ["true", "Bring", -170],
    ["false", "Answer", 170],
  ] as const) {
    const from = await boxOf(card(page, "Ask").getByLabel(`When ${outcome}`, { exact: true }));
    await page.mouse.move(from.x + from.width / 2, from.y + from.height / 2);
    await page.mouse.down();
    await page.mouse.move(from.x + 150, from.y + dy, { steps: 6 });
    await page.mouse.up();
    const search = page.getByRole("combobox", { name: "Name of an action" });
    await search.fill(next);
    await search.press("Enter");
    await expect(card(page, next)).toBeVisible();
  }
  await pick(page, ["Answer", 0]);
  await page.getByRole("button", { name: "Add", exact: true }).nth(1).click();
  const field = page.getByRole("combobox", { name: "Name of the parameter" });
  await field.fill("said");
  await field.press("Enter");
  await tidy(page);
  await connect(page, "Bring", "true", "exit");
  await connect(page, "Answer", "true", "exit");
  const waited = async () => (await umrfOf(product, id)).graph_exit.map((end) => end.required);
  await expect.poll(waited).toEqual([false, false]);
  const found = () => product.ask<{ code: string }[]>(`/api/graphs/${id}/problems`);
  expect(JSON.stringify(await found())).not.toContain('"H8"');

  await connect(page, "Ask", "true", "Answer");
  await expect.poll(waited).toEqual([true, true]);
  await page.keyboard.press("ControlOrMeta+z");
  await expect.poll(waited).toEqual([false, false]);
  expect(failures).toEqual([]);
  await context.close();
});

test("a graph with a loop and a renamed output is built from nothing", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1) ?? "";
  const name = page.getByRole("textbox", { name: "Graph", exact: true });
  await name.fill(fetching.graph_name);
  await name.press("Enter");
  await expect(page).toHaveTitle(/^fetch_all\b/);
  const parameter = async (of: string, side: "in" | "out", called: string) => {
    await pick(page, [of, 0]);
    await page
      .getByRole("button", { name: "Add", exact: true })
      .nth(side === "in" ? 0 : 1)
      .click();
    const field = page.getByRole("combobox", { name: "Name of the parameter" });
    await field.fill(called);
    await field.press("Enter");
  };
  await add(page, "Look");
  await parameter("Look", "out", "found");
  // Dragging an outcome to empty canvas asks what follows there.
  await page.keyboard.press("Escape");
  await enter(page, "Look");
  for (const [outcome, next, dx] of [
    ["true", "Fetch", -110],
    ["false", "Tell", 130],
  ] as const) {
    const from = await boxOf(card(page, "Look").getByLabel(`When ${outcome}`, { exact: true }));
    await page.mouse.move(from.x + from.width / 2, from.y + from.height / 2);
    await page.mouse.down();
    await page.mouse.move(from.x + dx, from.y + 150, { steps: 6 });
    await page.mouse.up();
    const search = page.getByRole("combobox", { name: "Name of an action" });
    await search.fill(next);
    await search.press("Enter");
    await expect(card(page, next)).toBeVisible();
  }
  await parameter("Fetch", "in", "thing");
  await parameter("Tell", "in", "text");
  const text = page.getByRole("textbox", { name: /^text/ });
  await text.fill("nothing left");
  await text.press("Enter");
  await tidy(page);
  await connect(page, "Tell", "true", "exit");

  // The way back is not waited for; it was drawn from the outcome to the card above.
  await connect(page, "Fetch", "true", "Look");
  const waits = page.getByRole("switch", { name: "Look waits for this" });
  await expect(waits).not.toBeChecked();
  await pick(page, ["Look", 0]);
  await page.getByRole("button", { name: /run Fetch$/ }).click();
  await page.getByRole("button", { name: "Rename an output" }).click();
  await page.getByRole("combobox", { name: "Output of Look" }).click();
  await page.getByRole("option", { name: /^found/ }).click();
  await page.getByRole("combobox", { name: "Reaches Fetch as" }).click();
  await page.getByRole("option", { name: /^thing/ }).click();
  await page.getByRole("button", { name: "Add", exact: true }).last().click();
  await expect(page.getByRole("button", { name: "Remove found as thing" })).toBeVisible();
  await saved(page);
  await expect.poll(() => meaningOf(product, id)).toEqual(await meant(product, fetching));
  expect(failures).toEqual([]);
  await context.close();
});
