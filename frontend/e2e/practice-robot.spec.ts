/** A robot to practise with, by one press, which ends with the server and is started again. */

import { expect, test } from "@playwright/test";
import { NO_ROS } from "./emulated-robot";
import { Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);

const product = new Product();
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("after the server was away the practice robot is gone, and one press starts it again", async ({
  browser,
}) => {
  test.slow();
  const { page, failures } = await product.person(browser, "Ada");
  const card = page.getByRole("article", { name: "Practice" });
  const again = card.getByRole("button", { name: "Start the practice robot again" });
  await page.goto(`${product.url}/robots`);
  await page.getByRole("button", { name: "Practice robot" }).click();
  await expect(card).toContainText("answers", { timeout: 30_000 });
  await expect(again).toBeHidden();
  await product.kill();
  await product.start();
  await expect(card).toContainText("gone", { timeout: 30_000 });
  await expect(card).toContainText("It ended with its runner.");
  await again.click();
  await expect(card).toContainText("answers", { timeout: 30_000 });
  await expect(again).toBeHidden();
  expect(failures).toEqual([]);
});
