/** With fingers only: a tablet does the whole job, and a phone does it too. */

import { type CDPSession, expect, type Locator, type Page, test } from "@playwright/test";
import { arrows, atRest, card, saved } from "./canvas";
import { LONG, Product, pause } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

type Point = readonly [x: number, y: number];

/** Fingers on glass. */
class Fingers {
  private readonly cdp: CDPSession;
  constructor(cdp: CDPSession) {
    this.cdp = cdp;
  }

  static async on(page: Page): Promise<Fingers> {
    return new Fingers(await page.context().newCDPSession(page));
  }

  private async send(type: "touchStart" | "touchMove" | "touchEnd", points: readonly Point[]) {
    const touchPoints = points.map(([x, y], id) => ({ x, y, id }));
    await this.cdp.send("Input.dispatchTouchEvent", { type, touchPoints });
  }

  /** Moves one or more fingers from where they go down to where they leave. */
  async move(...ways: readonly { from: Point; to: Point }[]): Promise<void> {
    // Fingers come down one after the other.
    for (const [i] of ways.entries()) {
      await this.send(
        "touchStart",
        ways.slice(0, i + 1).map(({ from }) => from),
      );
    }
    const steps = 8;
    for (let i = 1; i <= steps; i += 1) {
      await this.send(
        "touchMove",
        ways.map(
          ({ from, to }): Point => [
            from[0] + ((to[0] - from[0]) * i) / steps,
            from[1] + ((to[1] - from[1]) * i) / steps,
          ],
        ),
      );
    }
    await this.send("touchEnd", []);
  }

  /** Rests on a point until something is there. */
  async rest(at: Point, until: Locator): Promise<void> {
    await this.send("touchStart", [at]);
    await until.waitFor({ state: "visible" });
    await this.send("touchEnd", []);
  }
}

async function middle(locator: Locator, dy = 0.5): Promise<Point> {
  const box = await locator.boundingBox();
  if (box === null) throw new Error(`${locator} is not on screen`);
  return [box.x + box.width / 2, box.y + box.height * dy];
}

/** Where a card is taken: beside its input. */
async function grip(locator: Locator): Promise<Point> {
  const box = await locator.boundingBox();
  if (box === null) throw new Error(`${locator} is not on screen`);
  return [box.x + box.width / 4, box.y + box.height / 3];
}

const zoom = (page: Page) =>
  page
    .locator(".react-flow__viewport")
    .evaluate((element) => new DOMMatrix(getComputedStyle(element).transform).a);

async function add(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Add an action" }).first().tap();
  await page.getByRole("combobox", { name: "Name of an action" }).fill(name);
  await page.getByRole("option", { name: `New action “${name}”` }).tap();
  await expect(card(page, name)).toBeVisible();
}

/** Taps an outcome, then what follows. */
async function tie(page: Page, from: Locator, to: Locator): Promise<void> {
  await from.tap();
  await expect(page.getByRole("status").filter({ hasText: "tap what follows" })).toBeVisible();
  await to.tap({ position: { x: 30, y: 14 } });
}

async function run(page: Page): Promise<void> {
  const start = page.getByRole("button", { name: /^Run v\d+ in the simulator/ });
  await expect(start).toBeEnabled();
  await start.tap();
  await expect(
    page
      .getByText(/running|finished/)
      .locator("visible=true")
      .first(),
  ).toBeVisible();
}

/** Everything that can be pressed is large enough for a finger. */
async function small(page: Page, within: string): Promise<string[]> {
  return page.locator(`${within} button:visible`).evaluateAll((buttons) =>
    buttons
      .map((button) => ({ button, box: button.getBoundingClientRect() }))
      .filter(({ box }) => box.width > 0 && (box.width < 40 || box.height < 40))
      .map(
        ({ button, box }) => `${button.ariaLabel ?? button.textContent} ${box.width}×${box.height}`,
      ),
  );
}

const tablet = { viewport: { width: 768, height: 1024 }, hasTouch: true, isMobile: true };

test("a tablet: open, add, connect, set a parameter, start, stop", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", tablet);
  const fingers = await Fingers.on(page);
  await page.getByRole("button", { name: "New graph" }).first().tap();
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1) ?? "";
  await add(page, "Look");
  await add(page, "Grip");
  await tie(page, page.getByLabel("Start with", { exact: true }), card(page, "Look"));
  const when = (name: string, outcome: string) =>
    card(page, name).getByLabel(`When ${outcome}`, { exact: true });
  await tie(page, when("Look", "true"), card(page, "Grip"));
  const exit = page.locator(".react-flow__node").filter({ has: page.getByLabel("End with") });
  // Held upright, what runs to the right does not fit beside the bars at once.
  await page.getByRole("button", { name: "Fit", exact: true }).tap();
  await atRest(page);
  await tie(page, when("Grip", "true"), exit);
  const drawn = ["Grip_0 > exit", "Look_0 > Grip_0", "entry > Look_0"];
  await expect.poll(() => arrows(product, id)).toEqual(drawn);

  // A parameter, in the panel that slides in.
  await card(page, "Grip").tap({ position: { x: 40, y: 14 } });
  await page.getByRole("button", { name: "Add", exact: true }).first().tap();
  await page.getByRole("combobox", { name: "Name of the parameter" }).fill("force");
  await page.getByRole("combobox", { name: "Name of the parameter" }).press("Enter");
  await page.getByRole("textbox", { name: /^force/ }).fill("12");
  await page.getByRole("button", { name: "Details", exact: true }).tap();
  await expect(card(page, "Grip")).toContainText("force");
  await saved(page);

  // One finger drags a card.
  await page.getByRole("button", { name: "Fit", exact: true }).tap();
  await atRest(page);
  const before = await grip(card(page, "Grip"));
  await fingers.move({ from: before, to: [before[0] + 90, before[1] + 30] });
  await expect
    .poll(async () => (await grip(card(page, "Grip")))[0] - before[0])
    .toBeGreaterThan(60);

  // What was drawn is run by a tap, and stopped by another one.
  await expect.poll(() => arrows(product, id)).toEqual(drawn);
  await run(page);
  await page.getByRole("button", { name: /^Stop/ }).first().tap();
  await expect(
    page
      .getByText(/stopped|finished/)
      .locator("visible=true")
      .first(),
  ).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});

test("a tablet: two fingers zoom, a resting one opens the menu, taps choose several", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada", tablet);
  const fingers = await Fingers.on(page);
  await page.goto(`${product.url}/graphs/${await product.chain(2)}`);
  await saved(page);
  await expect(card(page, "Wait", 1)).toBeVisible();
  const scale = await zoom(page);
  await fingers.move({ from: [150, 250], to: [80, 240] }, { from: [620, 250], to: [700, 260] });
  await expect.poll(() => zoom(page)).toBeGreaterThan(scale * 1.1);
  const menu = page.getByRole("menu");
  await page.getByRole("button", { name: "Fit", exact: true }).tap();
  await atRest(page);
  await fingers.rest(await grip(card(page, "Wait", 0)), menu);
  await expect(menu.getByRole("menuitem", { name: "Duplicate", exact: true })).toBeVisible();
  expect(await small(page, '[role="menu"]')).toEqual([]);
  await menu.getByRole("menuitem", { name: "Duplicate", exact: true }).tap();
  await expect(card(page, "Wait", 2)).toBeVisible();
  await page.getByRole("button", { name: "Undo", exact: true }).tap();
  await expect(card(page, "Wait", 2)).toBeHidden();

  // In the select mode each tap adds, and a finger on empty canvas frames.
  const chosen = page.locator(".react-flow__node-action.selected");
  await page.getByRole("button", { name: "Select", exact: true }).tap();
  await card(page, "Wait", 0).tap({ position: { x: 40, y: 14 } });
  await card(page, "Wait", 1).tap({ position: { x: 40, y: 14 } });
  await expect(chosen).toHaveCount(2);
  await card(page, "Wait", 1).tap({ position: { x: 40, y: 14 } });
  await expect(chosen).toHaveCount(1);
  await page.locator(".react-flow__pane").tap({ position: { x: 30, y: 300 } });
  await expect(chosen).toHaveCount(0);
  const [left, top] = await middle(card(page, "Wait", 0), 0);
  const [right, bottom] = await middle(card(page, "Wait", 1), 1);
  await fingers.move({ from: [left - 150, top - 12], to: [right + 130, bottom + 20] });
  await expect(chosen).toHaveCount(2);
  // Two fingers move and zoom the view there too, and what was chosen stays so.
  const [near, before] = [await zoom(page), await middle(card(page, "Wait", 0))];
  await fingers.move({ from: [200, 640], to: [150, 700] }, { from: [500, 640], to: [600, 700] });
  await expect.poll(() => zoom(page)).toBeGreaterThan(near * 1.2);
  expect((await middle(card(page, "Wait", 0)))[1]).not.toBe(before[1]);
  await expect(chosen).toHaveCount(2);
  await page.getByRole("button", { name: "Select", exact: true }).tap();
  expect(await small(page, '[role="toolbar"]')).toEqual([]);

  expect(failures).toEqual([]);
  await context.close();
});

test("a tablet: a finger bends the line of an arrow that was tapped", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada", tablet);
  const fingers = await Fingers.on(page);
  await page.goto(`${product.url}/graphs/${await product.chain(2)}`);
  await saved(page);
  await page.getByRole("button", { name: "Fit", exact: true }).tap();
  await page.locator('[aria-label^="Arrow from entry"]').focus();
  await page.keyboard.press("Enter");
  const piece = page.getByRole("button", { name: /^Bend the line Entry → Wait 0, piece 1/ });
  await expect(piece).toHaveCSS("width", "44px");
  // What Fit and the choice moved stands still before a finger aims at it.
  await expect(async () => {
    const before = await middle(piece);
    await pause(150);
    expect(await middle(piece)).toEqual(before);
  }).toPass();
  const from = await middle(piece);
  const scale = await zoom(page);
  await fingers.move({ from, to: [from[0], from[1] + 90] });
  await expect(page.getByRole("button", { name: /^Bend 1 of 1 of the line/ })).toBeVisible();
  expect(await zoom(page)).toBe(scale);
  await expect(page.getByRole("menu")).toHaveCount(0);
  expect(failures).toEqual([]);
  await context.close();
});

test("a phone: add and connect on the canvas, start in the run tab, stop", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada", {
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  await page.getByRole("button", { name: "New graph" }).first().tap();
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1) ?? "";
  await add(page, "Rest");
  await page.getByText("Canvas", { exact: true }).tap();
  await tie(page, page.getByLabel("Start with", { exact: true }), card(page, "Rest"));
  const exit = page.locator(".react-flow__node").filter({ has: page.getByLabel("End with") });
  await page.getByText("Canvas", { exact: true }).tap();
  await tie(page, card(page, "Rest").getByLabel("When true", { exact: true }), exit);
  await expect.poll(() => arrows(product, id)).toEqual(["Rest_0 > exit", "entry > Rest_0"]);
  await saved(page);
  await page.getByText("Run", { exact: true }).tap();
  await run(page);
  await page.getByRole("button", { name: /^Stop/ }).first().tap();
  await expect(
    page
      .getByText(/stopped|finished/)
      .locator("visible=true")
      .first(),
  ).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});
