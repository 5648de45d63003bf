/** Lines that people bend by hand. */

import { expect, type Page, test } from "@playwright/test";
import { boxOf, card, pick, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** The waypoints that a file of the graph has. */
async function waypoints(id: string): Promise<readonly (readonly [number, number])[][]> {
  type Bent = {
    gui_attributes?: { action_assistant?: { waypoints?: { points: [number, number][] }[] } };
  };
  const { gui_attributes } = await product.ask<Bent>(`/api/graphs/${id}/umrf`);
  return (gui_attributes?.action_assistant?.waypoints ?? []).map(({ points }) => points);
}

test("a line is bent by hand, stays so for everybody, and is moved by keys", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const mari = await product.person(browser, "Mari");
  const id = await product.chain(2);
  for (const each of [page, mari.page]) {
    await each.goto(`${product.url}/graphs/${id}`);
    await saved(each);
  }
  const name = "Wait 0 → Wait 1";
  const choose = async (by: Page) => {
    await by.locator('[aria-label^="Arrow from Wait 0, when true"]').focus();
    await by.keyboard.press("Enter");
  };
  const bend = page.getByRole("button", { name: `Bend 1 of 1 of the line ${name}` });
  const piece = (by: Page) =>
    by.getByRole("button", { name: `Bend the line ${name}, piece 1 of`, exact: false }).first();

  await choose(page);
  const from = await boxOf(piece(page));
  const [x, y] = [from.x + from.width / 2, from.y + from.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  await page.mouse.move(x + 10, y + 60, { steps: 4 });
  await page.mouse.move(x + 10, y + 120, { steps: 4 });
  await page.mouse.up();
  await expect(bend).toBeFocused();
  await saved(page);
  const [[first] = []] = await waypoints(id);
  if (!first) throw new Error("the line is not bent");

  // A colleague sees the line go there; a page that is opened anew shows it, too.
  await choose(mari.page);
  const seen = mari.page.getByRole("button", { name: `Bend 1 of 1 of the line ${name}` });
  await expect(seen).toBeVisible();
  await page.reload();
  await saved(page);
  await choose(page);
  await expect(bend).toBeVisible();

  // Presses in a row are one step of undo; another takes the bend back.
  await bend.focus();
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Shift+ArrowRight");
  await expect.poll(() => waypoints(id)).toEqual([[[first[0] + 48, first[1] + 12]]]);
  await page.keyboard.press("ControlOrMeta+z");
  await expect.poll(() => waypoints(id)).toEqual([[first]]);
  await bend.focus();
  await page.keyboard.press("Delete");
  await expect(bend).toHaveCount(0);
  await expect.poll(() => waypoints(id)).toEqual([]);
  await page.keyboard.press("ControlOrMeta+z");
  await expect(bend).toBeVisible();

  // Its menu has them all removed.
  await bend.click({ button: "right" });
  await page.getByRole("menuitem", { name: "Straighten the line" }).click();
  await expect(bend).toHaveCount(0);
  await expect(seen).toHaveCount(0);
  expect([...failures, ...mari.failures]).toEqual([]);
  await Promise.all([context.close(), mari.context.close()]);
});

test("bends go along with both cards of their line, and Tidy straightens it, in one step", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(2);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await page.locator('[aria-label^="Arrow from Wait 0, when true"]').focus();
  await page.keyboard.press("Enter");
  const piece = page.getByRole("button", { name: /^Bend the line Wait 0 → Wait 1, piece 1/ });
  await piece.focus();
  await page.keyboard.press("Shift+ArrowDown");
  await page.keyboard.press("Shift+ArrowDown");
  await expect.poll(async () => (await waypoints(id)).length).toBe(1);
  await saved(page);
  const [[[x, y] = [0, 0]] = []] = await waypoints(id);

  await pick(page, ["Wait", 0], ["Wait", 1]);
  const before = await boxOf(card(page, "Wait", 0));
  await page.keyboard.press("Shift+ArrowDown");
  await expect.poll(() => waypoints(id)).toEqual([[[x, y + 32]]]);
  expect((await boxOf(card(page, "Wait", 0))).y).toBeGreaterThan(before.y);

  await page.getByRole("button", { name: "Tidy", exact: true }).click();
  await expect.poll(() => waypoints(id)).toEqual([]);
  await page.keyboard.press("ControlOrMeta+z");
  await expect.poll(() => waypoints(id)).toEqual([[[x, y + 32]]]);
  expect(failures).toEqual([]);
  await context.close();
});
