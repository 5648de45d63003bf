/** What stands beside the canvas: the lists, folded to a rail and back, and the details. */

import { expect, type Page, test } from "@playwright/test";
import { atRest, card, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.skip(LONG !== "", LONG);
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const FIRST = { panels: "folded" } as const;

/** Return the share of the window that the canvas has: of its area, and of its width. */
function share(page: Page): Promise<readonly [area: number, width: number]> {
  return page.evaluate(() => {
    const box = document.querySelector(".react-flow")?.getBoundingClientRect();
    const [width, height] = box ? [box.width / innerWidth, box.height / innerHeight] : [0, 0];
    return [width * height, width] as const;
  });
}

test("the canvas has most of the window, and the details leave it most of the width", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada", FIRST);
  await page.goto(`${product.url}/graphs/${await product.chain(3)}`);
  await saved(page);
  for (const [width, height, area, beside] of [
    [1440, 900, 0.84, 0.76],
    [1280, 720, 0.8, 0.7],
  ] as const) {
    await page.setViewportSize({ width, height });
    await expect.poll(async () => (await share(page))[0]).toBeGreaterThanOrEqual(area);
    await card(page, "Wait", 0).click();
    await expect(page.getByRole("complementary", { name: "Details" })).toBeVisible();
    await expect.poll(async () => (await share(page))[1]).toBeGreaterThanOrEqual(beside);
    await page.keyboard.press("Escape");
  }
  expect(failures).toEqual([]);
  await context.close();
});

test("the lists fold to a rail by which each is opened and put away, also by keys", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada", FIRST);
  await page.goto(`${product.url}/graphs/${await product.chain(2)}`);
  await saved(page);
  const rail = page.getByRole("navigation", { name: "Lists" });
  const library = page.getByRole("complementary", { name: "Library" });
  const search = library.getByRole("textbox", { name: "Search graphs and actions" });
  await expect(library).toBeHidden();
  await rail.getByRole("button", { name: "Unfold the list" }).click();
  await expect(rail).toHaveCount(0);
  await library.getByRole("button", { name: "Fold the list" }).click();
  await expect(library).toBeHidden();
  expect((await rail.boundingBox())?.width).toBe(56);
  await page.reload(); // remembered on this device
  await saved(page);
  await expect(library).toBeHidden();

  // By keys: the list opens, has the focus, and gives it back.
  const graphs = rail.getByRole("button", { name: "Graphs" });
  await expect(graphs).toHaveAttribute("aria-expanded", "false");
  await graphs.press("Enter");
  await expect(search).toBeFocused();
  await expect(graphs).toHaveAttribute("aria-expanded", "true");
  await page.keyboard.press("Escape");
  await expect(library).toBeHidden();
  await expect(graphs).toBeFocused();
  await page.locator("body").press("/");
  await expect(search).toBeFocused();
  await page.keyboard.press("Escape");

  // By mouse: another list, the same once more, and the canvas puts it away.
  const outline = rail.getByRole("button", { name: "Outline" });
  await outline.click();
  await expect(library.getByRole("treegrid")).toBeVisible();
  await outline.click();
  await expect(library).toBeHidden();
  await rail.getByRole("button", { name: "Actions" }).click();
  await library.getByRole("button", { name: "Wait" }).first().click();
  await expect(card(page, "Wait", 2)).toBeVisible();
  await expect(library).toBeHidden();
  await saved(page);

  // What nothing leads to is still to fill in: it is counted on the rail.
  const problems = rail.getByRole("button", { name: "Problems: 1 to fill in" });
  await expect(problems).toBeVisible();
  await problems.hover();
  await expect(page.getByRole("tooltip")).toHaveText("Problems: 1 to fill in");
  await problems.click();
  await expect(page.getByRole("tab", { name: /Problems/ })).toHaveAttribute(
    "aria-selected",
    "true",
  );
  await rail.getByRole("button", { name: "Unfold the list" }).click();
  await expect(rail).toHaveCount(0);
  await expect(library.getByRole("button", { name: "Fold the list" })).toBeFocused();
  expect(failures).toEqual([]);
  await context.close();
});

test("beside the rail the details are there while something is chosen, or when asked for", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada", FIRST);
  await page.goto(`${product.url}/graphs/${await product.chain(4)}`);
  await saved(page);
  const details = page.getByRole("complementary", { name: "Details" });
  const ask = page.getByRole("button", { name: "Details", exact: true });
  await expect(card(page, "Wait", 0)).toBeInViewport({ ratio: 0.9 });
  await expect(details).toBeHidden();

  // The card that is chosen stays where it is.
  await atRest(page);
  const at = await card(page, "Wait", 0).boundingBox();
  await card(page, "Wait", 0).click();
  await expect(details.getByRole("textbox", { name: "Name" })).toHaveValue("Wait");
  await atRest(page);
  expect(await card(page, "Wait", 0).boundingBox()).toEqual(at);
  await expect(ask).toHaveCount(0);
  await page.keyboard.press("Escape");
  await expect(details).toBeHidden();

  // Without anything chosen: what is said of the graph as a whole.
  await ask.click();
  await expect(details.getByRole("textbox", { name: "Graph", exact: true })).toBeVisible();
  await card(page, "Wait", 1).click();
  await page.keyboard.press("Escape");
  await expect(details).toBeHidden();

  // What would lie under the details comes out.
  await card(page, "Wait", 3).click();
  await expect(details).toBeVisible();
  await expect
    .poll(async () => {
      const [box, edge] = [await card(page, "Wait", 3).boundingBox(), await details.boundingBox()];
      return box !== null && edge !== null && box.x + box.width <= edge.x;
    })
    .toBe(true);
  expect(failures).toEqual([]);
  await context.close();
});
