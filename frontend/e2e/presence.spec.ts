/** Several people in one graph: whom they follow, who writes where, under whatever name. */

import { expect, type Page, test } from "@playwright/test";
import { add, card, saved } from "./canvas";
import { type Person, Product } from "./product";

const product = new Product();
// A letter that is read from the right; texts that turn others around are refused in names.
const HOSTILE = "<img src=x onerror=alert(1)> \u05d0";
let graph = "";
let ada: Person;
let mari: Person;
let third: Person;

test.beforeAll(async ({ browser }) => {
  test.setTimeout(180_000);
  await product.start();
  graph = await product.chain(3);
  ada = await product.person(browser, "Ada");
  mari = await product.person(browser, "名前 さん");
  third = await product.person(browser, HOSTILE, { viewport: { width: 1200, height: 700 } });
  for (const { page } of [ada, mari, third]) {
    await page.goto(`${product.url}/graphs/${graph}`);
    await expect(page.getByText("Saved", { exact: true })).toBeVisible({ timeout: 45_000 });
  }
  await expect(face(ada.page, "名前 さん")).toBeVisible();
});

test.afterAll(() => product.dispose());

function face(page: Page, name: string) {
  // A name that could turn the sentence around is isolated in it.
  return page.getByRole("button", { name: new RegExp(`^Follow \u2068?${name}`) });
}

const frame = (page: Page) => page.getByText(/^Following/);

/** Where the middle of the canvas is, in the graph's own pixels, and the zoom. */
async function looking(page: Page) {
  return page.evaluate(() => {
    const room = document.querySelector(".react-flow")?.getBoundingClientRect();
    const inside = document.querySelector<HTMLElement>(".react-flow__viewport");
    if (!room || !inside) throw new Error("no canvas");
    const { a, e, f } = new DOMMatrix(getComputedStyle(inside).transform);
    return {
      x: Math.round((room.width / 2 - e) / a),
      y: Math.round((room.height / 2 - f) / a),
      zoom: a,
    };
  });
}

async function pan(page: Page, dx: number, dy: number): Promise<void> {
  // From where nothing is drawn: a card or an arrow would be moved instead.
  const free = await page.evaluate(() => {
    const room = document.querySelector(".react-flow__pane")?.getBoundingClientRect();
    if (!room) throw new Error("no canvas");
    const rows = [0.5, 0.6, 0.7, 0.8, 0.4, 0.3].map((part) => room.y + room.height * part);
    const spots = rows.flatMap((y) => [60, 160, 260, 360].map((x) => [room.x + x, y] as const));
    return spots.find(([x, y]) => document.elementFromPoint(x, y)?.matches(".react-flow__pane"));
  });
  if (free === undefined) throw new Error("no free spot");
  const [x, y] = free;
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + dx, y + dy, { steps: 10 });
  await page.mouse.up();
}

/** Waits until both look at the same spot, a pixel or two apart, from the same height. */
async function together(one: Page, other: Page): Promise<void> {
  await expect
    .poll(async () => {
      const [a, b] = await Promise.all([looking(one), looking(other)]);
      const nearer = Math.max(a.zoom / b.zoom, b.zoom / a.zoom);
      return Math.max(Math.abs(a.x - b.x), Math.abs(a.y - b.y), 2000 * (nearer - 1));
    })
    .toBeLessThan(5);
}

test("who is followed leads; Esc, an own move, or leaving ends it", async () => {
  // By keyboard.
  await face(ada.page, "名前 さん").focus();
  await ada.page.keyboard.press("Enter");
  await expect(frame(ada.page)).toBeVisible();
  await expect(face(ada.page, "名前 さん")).toHaveAttribute("aria-pressed", "true");
  await pan(mari.page, 180, 120);
  await together(ada.page, mari.page);
  const { zoom } = await looking(mari.page);
  await mari.page.mouse.wheel(0, -300);
  await expect.poll(async () => (await looking(mari.page)).zoom).toBeGreaterThan(zoom);
  await together(ada.page, mari.page);
  await ada.page.screenshot({ path: test.info().outputPath("following.png") });
  await ada.page.emulateMedia({ colorScheme: "dark" });
  await ada.page.screenshot({ path: test.info().outputPath("following-dark.png") });
  await ada.page.emulateMedia({ colorScheme: "light" });

  await ada.page.keyboard.press("Escape");
  await expect(frame(ada.page)).toHaveCount(0);
  const before = await looking(ada.page);
  await pan(mari.page, -150, -60);
  await expect.poll(() => looking(mari.page)).not.toEqual(before);
  expect(await looking(ada.page)).toEqual(before);

  // An own move ends it too, and so does going away.
  await face(ada.page, "名前 さん").click();
  await together(ada.page, mari.page);
  await pan(ada.page, 40, 40);
  await expect(frame(ada.page)).toHaveCount(0);
  await face(mari.page, "Ada").click();
  await expect(frame(mari.page)).toBeVisible();
  const { url } = { url: ada.page.url() };
  await ada.page.goto(product.url);
  await expect(frame(mari.page)).toHaveCount(0);
  await ada.page.goto(url);
  await saved(ada.page);
});

/** Until no view moves: whoever clicks sooner may meet what was there before. */
async function atRest(...pages: Page[]): Promise<void> {
  let last = "";
  await expect
    .poll(async () => {
      const now = JSON.stringify(await Promise.all(pages.map(looking)));
      const still = now === last;
      last = now;
      return still;
    })
    .toBe(true);
}

test("two who follow each other, on screens of different sizes, come to rest", async () => {
  await face(mari.page, "<img").click();
  await face(third.page, "名前").click();
  for (const { page } of [mari, third]) await expect(frame(page)).toBeVisible();
  await atRest(mari.page, third.page);
  expect((await looking(mari.page)).zoom).toBeGreaterThan(0.2);
  for (const { page } of [mari, third]) await page.keyboard.press("Escape");
});

test("who has the caret in a field is seen there and at the card, and gone with the caret", async () => {
  for (const { page } of [ada, mari]) {
    await page.getByRole("button", { name: "Fit", exact: true }).click();
    await atRest(page);
    await card(page, "Wait", 1).click({ position: { x: 50, y: 30 } });
  }
  const name = mari.page.getByRole("textbox", { name: "Name", exact: true });
  await name.focus();
  const signs = ada.page.getByTitle("名前 さん is writing");
  await expect(signs).toHaveCount(2); // at the field, and at the card
  const field = ada.page.getByRole("textbox", { name: "Name", exact: true });
  const [box, at] = await Promise.all([field.boundingBox(), signs.first().boundingBox()]);
  expect(box).not.toBeNull();
  expect(at).not.toBeNull();
  await ada.page.screenshot({ path: test.info().outputPath("writing.png") });
  await ada.page.emulateMedia({ colorScheme: "dark" });
  await ada.page.screenshot({ path: test.info().outputPath("writing-dark.png") });
  await ada.page.emulateMedia({ colorScheme: "light" });
  await mari.page.getByRole("textbox", { name: "Number", exact: true }).focus();
  await expect(signs).toHaveCount(2);
  // The field goes while the caret is in it.
  await mari.page.keyboard.press("Escape");
  await mari.page.locator(".react-flow__pane").click({ position: { x: 30, y: 500 } });
  await expect(signs).toHaveCount(0);
});

test("each has a colour that nobody else has, everywhere the same, and leaves with the pointer", async () => {
  await card(mari.page, "Wait", 2).click({ position: { x: 50, y: 12 } });
  await mari.page.mouse.move(700, 420);
  await third.page.mouse.move(640, 380);
  const pointer = (name: string) =>
    ada.page.locator("[style*='--c'] bdi", { hasText: name }).locator("xpath=..");
  const faces = ada.page.getByRole("button", { name: /^Follow/ });
  await expect(faces).toHaveCount(2);
  const colors = await faces.evaluateAll((all) =>
    all.map((one) => getComputedStyle(one).backgroundColor),
  );
  expect(new Set(colors).size).toBe(2);
  for (const [name, color] of [
    ["<img", colors[0]],
    ["名前", colors[1]],
  ] as const) {
    await expect(pointer(name)).toHaveCSS("background-color", color ?? "");
  }
  await ada.page.getByText("Outline", { exact: true }).click();
  await expect(ada.page.getByTitle("名前 さん has it selected")).toHaveCSS(
    "background-color",
    colors[1] ?? "",
  );
  await ada.page.screenshot({ path: test.info().outputPath("colours.png") });
  await ada.page
    .getByRole("complementary", { name: "Library" })
    .getByText("Graphs")
    .first()
    .click();
  await mari.page.mouse.move(700, 4);
  await expect(pointer("名前")).toHaveCount(0);
});

test("names of any script and hostile ones are shown as they are, and do nothing", async () => {
  await expect(ada.page.getByText(/Also here:.*名前 さん/)).toBeAttached();
  await expect(ada.page.getByText(/Also here:.*<img src=x onerror=alert\(1\)>/)).toBeAttached();
  await third.page.mouse.move(600, 300);
  await third.page.mouse.move(620, 320);
  await expect(ada.page.locator("bdi", { hasText: "<img" }).first()).toBeVisible();
  await expect(ada.page.locator("bdi img")).toHaveCount(0);
  await add(third.page, "OfThird");
  await expect(card(ada.page, "OfThird")).toBeVisible();
  for (const { failures } of [ada, mari, third]) expect(failures).toEqual([]);
});

test("a hand that never rests tells the others at most twenty times a second", async () => {
  const page = await ada.context.newPage();
  let told = 0;
  page.on("websocket", (socket) => {
    if (!socket.url().includes("/room")) return;
    socket.on("framesent", ({ payload }) => {
      if (typeof payload !== "string" && payload[0] === 1) told += 1;
    });
  });
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  const before = told;
  const began = Date.now();
  while (Date.now() - began < 1500) {
    await page.mouse.move(500 + Math.random() * 300, 300 + Math.random() * 200);
    await page.mouse.wheel(0, Math.random() < 0.5 ? 20 : -20);
  }
  const seconds = (Date.now() - began) / 1000;
  expect(told - before).toBeGreaterThan(5);
  expect(told - before).toBeLessThanOrEqual(Math.ceil(seconds * 20) + 1);
  await page.close();
});
