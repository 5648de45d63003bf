/** On a phone, with fingers only: a graph is made, connected, given a parameter, started, stopped. */

import { expect, type Locator, type Page, test } from "@playwright/test";
import { boxOf, card, hold, saved, umrfOf } from "./canvas";
import { LONG, Product } from "./product";
import { post, VALVES } from "./valves";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

/** A finger that rests on a button for as long as it asks for. */
async function press(page: Page, on: Locator): Promise<void> {
  const box = await on.boundingBox();
  if (box === null) throw new Error("it is not on screen");
  const touch = { x: box.x + box.width / 2, y: box.y + box.height / 2 };
  const hand = await page.context().newCDPSession(page);
  await hold(
    on,
    () => hand.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [touch] }),
    () => hand.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] }),
  );
}

const pane = (page: Page, name: string) =>
  page.getByRole("radiogroup").getByText(name, { exact: true }).tap();

const menu = async (page: Page, row: string, item: RegExp) => {
  await page.getByRole("button", { name: `What to do with ${row}`, exact: true }).tap();
  await page.getByRole("menuitem", { name: item }).tap();
};

const choose = async (page: Page, box: string, option: string) => {
  await page.getByRole("combobox", { name: box, exact: true }).tap();
  await page.getByRole("option", { name: option, exact: true }).tap();
};

async function add(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Add an action" }).tap();
  await page.getByRole("combobox", { name: "Name of an action" }).fill(name);
  await page.getByRole("option", { name: `New action “${name}”` }).tap();
  await expect(page.getByRole("row", { name: new RegExp(`^${name}\\b`) })).toBeVisible();
}

test("a graph is made in the outline", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", PHONE);
  await page.getByRole("button", { name: "New graph" }).first().tap();
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1)?.split(/[?#]/)[0];
  await pane(page, "Outline");
  const names = page.getByRole("radiogroup").first().locator("span");
  const cut = names.evaluateAll((all) => all.filter((each) => each.scrollWidth > each.clientWidth));
  expect(await names.count()).toBe(5);
  expect(await cut).toHaveLength(0);
  await add(page, "Spot");
  await add(page, "Take");

  // The graph starts with what was added first.
  await expect(page.getByRole("button", { name: "run Spot" })).toBeVisible();
  await menu(page, "Spot", /Connect/);
  await choose(page, "Run", "Take");
  await expect(page.getByRole("button", { name: "When true: run Take" })).toBeVisible();
  await menu(page, "Take", /Connect/);
  await choose(page, "Run", "Exit: the graph ends");
  // A chip for each bundle of outcomes, with everything that can be done to it.
  await page.getByRole("button", { name: "When true: run Take" }).tap();
  await page.getByRole("menuitem", { name: "Another response …" }).tap();
  await page.getByRole("option", { name: "stop", exact: true }).tap();
  await page.getByRole("button", { name: "When true: stop Take" }).tap();
  await page.getByRole("menuitem", { name: "Another response …" }).tap();
  await page.getByRole("option", { name: "run", exact: true }).tap();

  await page
    .getByRole("row", { name: /^Take\b/ })
    .getByText("Take", { exact: true })
    .first()
    .tap();
  await page.getByRole("button", { name: "Add", exact: true }).first().tap();
  await page.getByRole("combobox", { name: "Name of the parameter" }).fill("force");
  await page.locator("form").getByRole("button", { name: "Add", exact: true }).tap();
  const force = page.getByRole("textbox", { name: /^force/ });
  await force.fill("gentle");
  await force.blur();
  await saved(page);
  const { actions, graph_entry } = await product.ask<{
    actions: Record<string, unknown>[];
    graph_entry: unknown;
  }>(`/api/graphs/${id}/umrf`);
  expect(graph_entry).toEqual([{ name: "Spot", instance_id: 0 }]);
  expect(actions[1]).toMatchObject({
    name: "Take",
    input_parameters: { force: { pvf_value: "gentle" } },
    parents: [{ name: "Spot" }],
  });
  expect(failures).toEqual([]);
  await context.close();
});

test("a graph opens with its outline, which says how its run goes; the device keeps the choice", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada", {
    ...{ ...PHONE, panels: "folded" },
  });
  await page.goto(`${product.url}/graphs/${await product.chain(3)}`);
  const row = (instance: number) =>
    page.getByRole("row", { name: new RegExp(`^Wait ${instance}`) });
  await expect(row(2)).toBeVisible();
  await saved(page);
  const tabs = page.getByRole("radiogroup");
  const shift = tabs.boundingBox();
  await press(page, page.getByRole("button", { name: /^Run v1 in the simulator/ }));
  await expect(row(1)).toContainText("running");
  await expect(page.getByRole("button", { name: /^Stop / })).toBeInViewport({ ratio: 1 });
  await expect(row(2)).toContainText("true");
  expect(await tabs.boundingBox()).toEqual(await shift);

  await pane(page, "Canvas");
  await expect(card(page, "Wait", 2)).toBeVisible();
  await page.reload();
  await expect(card(page, "Wait", 2)).toBeVisible();
  await pane(page, "Outline");
  await page.reload();
  await expect(row(2)).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});

test("a breakpoint is set in the outline; the run waits there, and goes on by a finger", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada", {
    ...{ ...PHONE, panels: "folded" },
  });
  await page.goto(`${product.url}/graphs/${await product.chain(3)}`);
  await saved(page);
  await page.getByRole("button", { name: "What to do with Wait 1", exact: true }).tap();
  const last = page.getByRole("menuitem", { name: "Delete" });
  await expect(last).toBeVisible();
  const stop = page.getByRole("button", { name: /^Stop / });
  const [end, bar] = [await boxOf(last), await boxOf(stop)];
  expect(end.y + end.height).toBeLessThanOrEqual(bar.y);
  await page.getByRole("menuitem", { name: "Set a breakpoint" }).tap();
  const row = page.getByRole("row", { name: /^Wait 1/ });
  await expect(row.getByTitle("A led run waits before this")).toBeVisible();
  await saved(page);

  await page.getByRole("button", { name: "Run v1 in the simulator …" }).tap();
  const start = page
    .getByRole("dialog")
    .getByRole("button", { name: /^Run v\d+, step by step, in/ });
  await expect(start).toBeEnabled();
  await start.scrollIntoViewIfNeeded();
  await press(page, start);
  const waits = page
    .getByRole("region", { name: "The run waits for a person" })
    .filter({ visible: true });
  await expect(waits).toContainText("Breakpoint before Wait 1");
  await expect(stop).toBeInViewport({ ratio: 1 });
  await press(page, waits.getByRole("button").filter({ hasText: "Go on" }));
  await expect(row).toContainText("true");
  await expect(waits).toBeHidden();

  await menu(page, "Wait 1", /Remove the breakpoint/);
  await expect(row.getByTitle("A led run waits before this")).toBeHidden();
  expect(failures).toEqual([]);
  await context.close();
});

test("a phone draws a graph without places top-down, and alters it for nobody until a card is moved", async ({
  browser,
}) => {
  const id = await product.chain(4);
  const places = async () =>
    (await umrfOf(product, id)).actions.map((action) => action.gui_attributes?.position);
  const { page, context, failures } = await product.person(browser, "Ada", PHONE);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  const [first, last] = [await boxOf(card(page, "Wait", 0)), await boxOf(card(page, "Wait", 3))];
  expect(last.y).toBeGreaterThan(first.y + 3 * first.height);
  expect(Math.abs(last.x - first.x)).toBeLessThan(first.width);
  await expect(page.getByRole("button", { name: /^Run v1 in the simulator/ })).toBeEnabled();
  expect(await places()).toEqual([undefined, undefined, undefined, undefined]);

  const desk = await product.person(browser, "Mari");
  await desk.page.goto(`${product.url}/graphs/${id}`);
  await saved(desk.page);
  await expect.poll(places).not.toContain(undefined);
  const [from, to] = [
    await boxOf(card(desk.page, "Wait", 0)),
    await boxOf(card(desk.page, "Wait", 3)),
  ];
  expect(to.x).toBeGreaterThan(from.x + from.width);
  // From now on it has places, and they hold for all.
  await expect
    .poll(
      async () => (await boxOf(card(page, "Wait", 1))).y - (await boxOf(card(page, "Wait", 0))).y,
    )
    .toBeLessThan(first.height);
  expect(failures).toEqual([]);
  await context.close();
});

test("a phone shows a placed graph top-down at one tap, to look at, on its screen alone", async ({
  browser,
}) => {
  const { id } = await post<{ id: string }>(product, "/api/graphs", VALVES);
  const stored = async () => (await umrfOf(product, id)).actions;
  const before = await stored();
  const { page, context, failures } = await product.person(browser, "Ada", PHONE);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  const [first, last] = [card(page, "Drive"), card(page, "Report")];
  const isDown = async () => {
    const [from, to] = [await boxOf(first), await boxOf(last)];
    return to.y > from.y + from.height && Math.abs(to.x - from.x) < from.width;
  };
  await expect.poll(isDown).toBe(false);
  await page.getByRole("button", { name: "Top-down" }).tap();
  await expect(page.getByText("View only")).toBeVisible();
  await expect.poll(isDown).toBe(true);
  await expect(page.getByRole("button", { name: "Add an action" })).toBeDisabled();
  await pane(page, "Outline");
  await expect(page.getByRole("button", { name: "Add an action" })).toBeEnabled();
  await page.reload();
  await pane(page, "Canvas");
  await expect.poll(isDown).toBe(true);
  await page.getByRole("button", { name: "As placed" }).tap();
  await expect.poll(isDown).toBe(false);
  await expect(page.getByText("Saved", { exact: true })).toBeVisible();
  expect(await stored()).toEqual(before);
  expect(failures).toEqual([]);
  await context.close();
});

test("STOP is at one place, apart from Start, and everything is large enough for a finger", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada", PHONE);
  const home = await page.getByRole("button", { name: /^Stop / }).boundingBox();
  const id = await product.chain(12);
  // A name that nothing has room for pushes nothing away.
  await product.ask(`/api/graphs/${id}`, {
    method: "PATCH",
    body: JSON.stringify({ name: "a_name_written_out_in_full_so_that_nobody_has_to_ask" }),
    headers: { "content-type": "application/json" },
  });
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  for (const name of ["Canvas", "Outline", "Details", "Run"]) {
    await pane(page, name);
    const stop = await page.getByRole("button", { name: /^Stop / }).boundingBox();
    expect(stop?.height).toBeGreaterThanOrEqual(60);
    expect((stop?.y ?? 0) + (stop?.height ?? 0)).toBeGreaterThan(820);
    expect(stop).toEqual(home);
    const begin = await page.getByRole("button", { name: /^Run v1/ }).boundingBox();
    // More than two fingers beside each other.
    expect((stop?.x ?? 0) - (begin?.x ?? 0) - (begin?.width ?? 0)).toBeGreaterThan(80);
    const small = await page.evaluate(() => {
      const found: string[] = [];
      for (const each of document.querySelectorAll<HTMLElement>("main button, header button")) {
        const { width, height } = each.getBoundingClientRect();
        const free = each.closest(".react-flow, [role=treegrid] tr") === null || height === 0;
        if (free && width > 0 && Math.min(width, height) < 24)
          found.push(`${each.textContent || each.ariaLabel} ${width}×${height}`);
      }
      return found;
    });
    expect(small, name).toEqual([]);
  }

  const start = page.getByRole("button", { name: /^Run v1 in the simulator/ });
  await expect(start).toBeEnabled();
  await press(page, start);
  await pane(page, "Run");
  await expect(page.locator('[data-tone="run"]').first()).toBeVisible();
  await page.getByRole("button", { name: /^Stop / }).tap();
  await expect(page.getByText(/stopped/).first()).toBeVisible();
  await context.close();
});

test("the form of an action is compact, and its targets are large", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada", PHONE);
  const number = { pvf_type: "number", pvf_value: 1 };
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    body: JSON.stringify({
      graph_name: "compact",
      graph_entry: [{ name: "Go", instance_id: 0 }],
      graph_exit: [{ name: "Go", instance_id: 0 }],
      actions: [
        {
          name: "Go",
          instance_id: 0,
          type: "sync",
          input_parameters: {
            place: { pvf_type: "string", pvf_value: "valve_7" },
            careful: { pvf_type: "bool", pvf_value: true },
            at: { x: number, y: number, z: number },
          },
        },
      ],
    }),
    headers: { "content-type": "application/json" },
  });
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await page.getByText("Go", { exact: true }).first().tap();
  await pane(page, "Details");
  const details = page.getByRole("main");
  const boxOf = async (what: Locator) => {
    const box = await what.boundingBox();
    if (box === null) throw new Error("it is not on screen");
    return box;
  };
  // What a field is called stands in its row.
  const place = details.getByRole("textbox", { name: /^place/ });
  const [field, name] = [await boxOf(place), await boxOf(details.getByTitle("place"))];
  expect(name.x + name.width).toBeLessThanOrEqual(field.x);
  expect(name.y).toBeGreaterThanOrEqual(field.y - 4);
  expect(name.y + name.height).toBeLessThanOrEqual(field.y + field.height);
  const bool = await boxOf(details.getByRole("radiogroup", { name: "careful" }));
  expect((await boxOf(details.getByTitle("careful"))).x).toBeLessThan(bool.x - 40);
  // Three numbers are one row.
  const rows = await Promise.all(
    ["x", "y", "z"].map((axis) => boxOf(details.getByRole("textbox", { name: `${axis} of at` }))),
  );
  expect(new Set(rows.map(({ y }) => Math.round(y))).size).toBe(1);
  for (const { height } of [field, ...rows]) expect(height).toBeGreaterThanOrEqual(44);
  for (const what of ["What the parameter place is", "The numbers of at one by one"]) {
    const { width, height } = await boxOf(details.getByRole("button", { name: what }));
    expect(Math.min(width, height)).toBeGreaterThanOrEqual(44);
  }
  const size = (of: Locator) =>
    of.evaluate((found) => Number.parseFloat(getComputedStyle(found).fontSize));
  expect(Math.round(await size(place))).toBe(15);
  expect(
    Math.round(await size(details.getByTitle("place").locator("xpath=following-sibling::*[1]"))),
  ).toBe(13);
  expect(failures).toEqual([]);
  await context.close();
});

test("no dialog lies under STOP, however tall it is, on a phone held either way", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada", PHONE);
  const stop = page.getByRole("button", { name: /^Stop / });
  /** By how much the dialog lies over STOP's place, px; the page is at rest. */
  const overlap = async () => {
    const dialog = page.getByRole("dialog");
    await expect(dialog).toBeVisible();
    await expect.poll(() => dialog.evaluate((it) => it.getAnimations().length)).toBe(0);
    const [own, its] = [await dialog.boundingBox(), await stop.boundingBox()];
    if (own === null || its === null) throw new Error("one of them is not on screen");
    const across = Math.min(own.x + own.width, its.x + its.width) - Math.max(own.x, its.x);
    const down = Math.min(own.y + own.height, its.y + its.height) - Math.max(own.y, its.y);
    return Math.min(across, down);
  };
  const share = async () => {
    await page.goto(product.url);
    await page.getByRole("button", { name: "Ada" }).tap();
    await page.getByRole("button", { name: /^Share/ }).tap();
    await expect(page.getByRole("dialog")).toHaveCount(1); // the menu of Ada has closed
  };
  const deleted = async () => {
    // More than the screen is tall.
    for (let i = 0; i < 12; i += 1) {
      await product.ask(`/api/graphs/${await product.chain(1)}`, { method: "DELETE" });
    }
    await page.goto(product.url);
    await page.getByRole("button", { name: "Deleted graphs" }).tap();
    await expect(page.getByRole("dialog").getByText("chain_1").nth(11)).toBeAttached();
  };
  for (const open of [share, deleted]) {
    await open();
    await expect.poll(overlap).toBeLessThanOrEqual(0);
    await page.setViewportSize({ width: 844, height: 390 });
    await expect.poll(overlap).toBeLessThanOrEqual(0);
    await page.setViewportSize(PHONE.viewport);
  }
  await context.close();
});

test("a turned phone keeps the look before a start, with what was chosen", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Mari", PHONE);
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).tap();
  const look = page.getByRole("dialog");
  await look.getByRole("checkbox", { name: "Repeat it" }).check();
  for (const viewport of [
    { width: 844, height: 390 },
    { width: 1200, height: 800 },
    PHONE.viewport,
  ]) {
    await page.setViewportSize(viewport);
    await expect(look.getByRole("checkbox", { name: "Repeat it" })).toBeChecked();
  }
  await page.keyboard.press("Escape");
  await expect(look).toHaveCount(0);
  expect(failures).toEqual([]);
  await context.close();
});
