/** What is seen: text stays readable on opening, Fit shows the whole, the view follows a run. */

import { expect, type Page, test } from "@playwright/test";
import { card, fitView, saved, start } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const zoom = (page: Page) =>
  page
    .locator(".react-flow__viewport")
    .evaluate((element) => new DOMMatrix(getComputedStyle(element).transform).a);

/** A point of the canvas on which nothing lies. */
function freeSpot(page: Page): Promise<readonly [number, number]> {
  return page.locator(".react-flow__pane").evaluate((pane) => {
    const { left, top, width, height } = pane.getBoundingClientRect();
    for (let x = left + 12; x < left + width; x += 12) {
      for (let y = top + 12; y < top + height / 2; y += 12) {
        if (document.elementFromPoint(x, y) === pane) return [x, y] as const;
      }
    }
    throw new Error("nothing of the canvas is free");
  });
}

for (const [what, viewport, least, count] of [
  ["a desktop", { width: 1440, height: 900 }, 0.9, 150],
  ["a phone", { width: 390, height: 844 }, 0.6, 40], // as many as Fit can show at the least zoom
] as const) {
  test(`a large graph opens at its beginning and readable on ${what}`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada", { viewport });
    await page.goto(`${product.url}/graphs/${await product.chain(count)}`);
    await saved(page);
    await expect.poll(() => zoom(page)).toBeCloseTo(least, 2);
    await expect(card(page, "Wait", 0)).toBeInViewport();
    await expect(card(page, "Wait", count - 1)).not.toBeInViewport();

    // Fit shows all of it, also when it is pressed once more.
    await fitView(page);
    await expect(card(page, "Wait", count - 1)).toBeInViewport({ ratio: 0.99 });
    await expect(card(page, "Wait", 0)).toBeInViewport({ ratio: 0.99 });
    await expect.poll(() => zoom(page)).toBeLessThan(least);
    // Lines that are still being routed take room, too; once they are there Fit changes nothing.
    let all = 0;
    await expect(async () => {
      const before = await zoom(page);
      await fitView(page);
      all = await zoom(page);
      expect(all).toBeCloseTo(before, 3);
    }).toPass();
    await fitView(page);
    expect(await zoom(page)).toBeCloseTo(all, 3);
    await context.close();
  });
}

test("Fit shows all of a graph also when it is pressed before the graph has places", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(80)}`);
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await saved(page);
  await expect(card(page, "Wait", 79)).toBeInViewport({ ratio: 0.99 });
  await expect(card(page, "Wait", 0)).toBeInViewport({ ratio: 0.99 });
  await context.close();
});

test("a graph of a screen opens whole, and is whole again when its run has ended", async ({
  browser,
}) => {
  const viewport = { width: 1024, height: 768 };
  const { page, context } = await product.person(browser, "Ada", { viewport, panels: "folded" });
  await page.goto(`${product.url}/graphs/${await product.chain(5)}`);
  await saved(page);
  const isWhole = async () => {
    for (const instance of [0, 4])
      await expect(card(page, "Wait", instance)).toBeInViewport({ ratio: 0.99 });
    await expect(page.getByLabel("End with")).toBeInViewport();
  };
  await isWhole();
  // Zoomed in before, so that the view has to follow what runs.
  for (let i = 0; i < 4; i += 1) await page.getByRole("button", { name: "Zoom in" }).click();
  await expect(card(page, "Wait", 4)).not.toBeInViewport();
  await start(page);
  await expect(card(page, "Wait", 4)).toBeInViewport({ timeout: 30_000 });
  await expect(card(page, "Wait", 0)).not.toBeInViewport();
  await expect(page.getByText("finished").first()).toBeVisible({ timeout: 30_000 });
  await isWhole();
  await context.close();
});

test("the view follows what runs until the person moves it, and again when asked", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(60)}`);
  await saved(page);
  await expect(card(page, "Wait", 0)).toBeInViewport();
  await expect(card(page, "Wait", 5)).not.toBeInViewport();
  await start(page);
  await expect(card(page, "Wait", 5)).toBeInViewport({ timeout: 30_000 });
  await expect(page.getByRole("list", { name: /Actions of the run/ })).toBeVisible();

  await page.getByRole("button", { name: "Hide the lanes" }).click();
  await expect(page.getByRole("list", { name: /Actions of the run/ })).toHaveCount(0);
  await page.getByRole("button", { name: "Show the lanes" }).click();

  const follow = page.getByRole("button", { name: "Follow the run" });
  // The view may glide to the next action just when it is taken.
  await expect(async () => {
    const free = await freeSpot(page);
    await page.mouse.move(...free);
    await page.mouse.down();
    await page.mouse.move(free[0], free[1] + 400, { steps: 5 });
    await page.mouse.up();
    await expect(follow).toBeVisible({ timeout: 2_000 });
  }).toPass();
  await follow.click();
  await expect(follow).toBeHidden();
  await expect(
    page.locator(".react-flow__node-action").filter({ hasText: "running" }).first(),
  ).toBeInViewport();
  expect(failures).toEqual([]);
  await context.close();
});

test("whoever takes hold of the canvas while it glides holds what they see", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(30)}`);
  await saved(page);
  const tools = await context.newCDPSession(page);
  await tools.send("Animation.enable");
  await tools.send("Animation.setPlaybackRate", { playbackRate: 0.02 }); // 20 s for a glide
  const sheet = page.locator(".react-flow__viewport");
  await start(page);
  // Only the glide animates the sheet of the canvas; the view behind it is where it will end.
  const glides = () => sheet.evaluate((element) => element.getAnimations().length);
  await expect.poll(glides, { timeout: 30_000 }).toBe(1);
  const [x, y] = await freeSpot(page);
  const place = () =>
    sheet.evaluate((element) => {
      const { e, f } = new DOMMatrix(getComputedStyle(element).transform);
      return [e, f] as const;
    });
  await page.mouse.move(x, y);
  const before = await place();
  await page.mouse.down();
  await expect.poll(glides).toBe(0);
  const held = await place();
  expect(Math.hypot(held[0] - before[0], held[1] - before[1])).toBeLessThan(60);
  await page.mouse.move(x + 40, y + 30, { steps: 4 });
  await page.mouse.up();
  const [moved] = await place();
  expect(moved - held[0]).toBeGreaterThan(30);
  expect(moved - held[0]).toBeLessThan(50);
  await context.close();
});
