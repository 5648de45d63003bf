/** What the page says of times when the browser's clock is hours off: everything is by the server's clock. */

import { expect, test } from "@playwright/test";
import { saved, start } from "./canvas";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

/** The browser's own clock from now on: `ms` ahead of this computer's. */
function shiftClock(ms: number): void {
  const Real = Date;
  const now = () => Real.now() + ms;
  class Shifted extends Real {
    constructor(...given: [] | [number | string]) {
      super(given.length === 0 ? now() : given[0]);
    }
    static override now = now;
  }
  Object.assign(globalThis, { Date: Shifted });
}

for (const [what, hours] of [
  ["ahead", 3],
  ["behind", -3],
] as const) {
  test(`a tablet whose clock is three hours ${what} shows how long things take as any other`, async ({
    browser,
  }) => {
    const { page, context, failures } = await product.person(browser, "Ada");
    await context.addInitScript(shiftClock, hours * 3_600_000);
    await page.goto(`${product.url}/graphs/${await product.chain(30)}`);
    await saved(page);
    expect(
      await page.evaluate(() => Math.round((Date.now() - performance.timeOrigin) / 3.6e6)),
    ).toBe(hours);
    await start(page);
    const cards = page.locator(".react-flow__node-action");
    await expect(cards.filter({ hasText: /running\s*· 0:0\d/ }).first()).toBeVisible();
    await page.getByRole("link", { name: "Runs" }).click();
    const row = page.getByRole("row").filter({ hasText: "chain_30" }).first();
    await expect(row).toContainText(/today.*0:[0-5]\d$/);
    await expect(page.locator("body")).not.toContainText(/(?<![\d:])(180:|2:59:|3:00:)|h ago/);
    await expect(page.getByText(/STOP MAY REACH NOBODY|NOT SENT|UNCONFIRMED/)).toHaveCount(0);
    await page.getByRole("button", { name: /^Stop / }).click();
    await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
    expect(failures).toEqual([]);
    await context.close();
  });
}
