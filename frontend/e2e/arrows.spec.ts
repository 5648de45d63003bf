/** One outcome of an arrow that says several: led elsewhere alone. */

import { expect, test } from "@playwright/test";
import { boxOf, card, saved, umrfOf } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** What an action says to another for each outcome; none when they are not tied. */
async function said(id: string, from: number, to: number): Promise<readonly string[]> {
  const target = (await umrfOf(product, id)).actions.find(({ instance_id }) => instance_id === to);
  const parent = target?.parents?.find(({ instance_id }) => instance_id === from);
  return (parent?.conditions ?? []).filter((each) => !each.endsWith("ignore"));
}

test("one outcome of several is led elsewhere alone: dragged off its pill, or by keys", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  const rest = ["on_true -> run", "on_false -> run"];
  const all = [...rest, "on_error -> run"];
  await card(page, "Wait", 0).getByLabel("When error", { exact: true }).click();
  await card(page, "Wait", 1).click({ position: { x: 60, y: 12 } });
  await expect.poll(() => said(id, 0, 1)).toEqual(all);

  // It is chosen as it was drawn: its pill offers both.
  const off = page.getByRole("button", { name: "Lead “error” of Wait 0 → Wait 1 elsewhere" });
  const from = await boxOf(off);
  const to = await boxOf(card(page, "Wait", 2));
  const drag = async (x: number, y: number) => {
    await page.mouse.move(from.x + from.width / 2, from.y + from.height / 2);
    await page.mouse.down();
    await page.mouse.move(from.x + 30, from.y + 40, { steps: 4 });
    await page.mouse.move(x, y, { steps: 6 });
  };
  await drag(to.x + to.width / 2, to.y + to.height + 90);
  await page.mouse.up();
  await drag(to.x + 20, to.y + 20);
  await page.keyboard.press("Escape");
  await page.mouse.up();
  await expect(off).toBeVisible();
  expect(await said(id, 0, 1)).toEqual(all);
  await drag(to.x + 20, to.y + 20);
  await page.mouse.up();
  await expect.poll(() => said(id, 0, 2)).toEqual(["on_error -> run"]);
  expect(await said(id, 0, 1)).toEqual(rest);
  await page.keyboard.press("ControlOrMeta+z");
  await expect.poll(() => said(id, 0, 2)).toEqual([]);
  expect(await said(id, 0, 1)).toEqual(all);

  // By keys: from the pill, or with its key and the outcome in the dialog.
  await page.locator('[aria-label^="Arrow from Wait 0, when error"]').focus();
  await page.keyboard.press("Enter");
  await expect(off).toBeVisible();
  await off.focus();
  await page.keyboard.press("Enter");
  const dialog = page.getByRole("dialog", { name: "Lead the arrow elsewhere" });
  await expect(dialog.getByRole("button", { name: "error" })).toHaveAttribute(
    "aria-pressed",
    "true",
  );
  await page.keyboard.press("Escape");
  await expect(dialog).toBeHidden();
  // The sign in the pill keeps no other key from doing what it does everywhere.
  await off.focus();
  await page.keyboard.press("r");
  await dialog.getByRole("button", { name: "error" }).click();
  await dialog.getByRole("combobox", { name: "To", exact: true }).fill("Wait 2");
  await page.keyboard.press("Enter");
  await expect.poll(() => said(id, 0, 2)).toEqual(["on_error -> run"]);
  expect(await said(id, 0, 1)).toEqual(rest);
  expect(failures).toEqual([]);
  await context.close();
});

test("the menu of a card opens the dialog that draws an arrow", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(3)}`);
  await saved(page);
  await card(page, "Wait", 1).click({ button: "right" });
  await page.getByRole("menuitem", { name: "Draw an arrow …" }).click();
  await expect(page.getByRole("dialog")).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});
