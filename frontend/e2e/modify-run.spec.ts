/** A running graph is changed from the page, where that is safe: the simulator says that it is. */

import { expect, test } from "@playwright/test";
import { add, card, give, saved, start } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();
test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

interface Run {
  id: string;
  state: string;
  version: string;
}

test("what is on screen is sent to the running robot, after what becomes different was shown", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(40)}`);
  await saved(page);
  await give(page, "Wait", "delay", "0.5");
  await saved(page);
  // Opened before the run begins, which takes 40 s only.
  const other = await product.person(browser, "Mari");
  await other.page.goto(page.url());
  await saved(other.page);
  await start(page);
  const newest = async () => (await product.ask<Run[]>("/api/runs", {}, product.runnerUrl))[0];
  await expect.poll(async () => (await newest())?.state).toBe("running");
  const before = (await newest())?.version;
  const delay = page.getByRole("textbox", { name: /^delay/ });
  await delay.fill("0.9");
  await delay.press("Enter");
  await saved(page);
  await page.getByRole("button", { name: "Send to the running robot …" }).click();
  const dialog = page.getByRole("dialog");
  const changes = dialog.getByRole("list", { name: "What becomes different" });
  await expect(changes.getByRole("listitem")).toHaveCount(1);
  await expect(changes).toContainText('Action Wait_0 changeddelay: "0.5" → "0.9"');
  await page.screenshot({ path: test.info().outputPath("send-change.png") });
  // What somebody else changes meanwhile is neither sent nor listed.
  await add(other.page, "Theirs");
  await saved(other.page);
  await expect(card(page, "Theirs")).toBeAttached(); // the page has followed
  await expect(changes.getByRole("listitem")).toHaveCount(1);
  await expect(changes).toContainText('delay: "0.5" → "0.9"');
  await other.context.close();
  await dialog.getByRole("button", { name: /^Send v2 to run 1/ }).focus();
  await page.keyboard.down("Enter");
  await expect(dialog).toBeHidden();
  await page.keyboard.up("Enter");
  await expect.poll(async () => (await newest())?.version).not.toBe(before);
  const version = (await newest())?.version ?? "";
  const sent = await product.ask<{ umrf: unknown }>(`/api/versions/${version}`);
  expect(JSON.stringify(sent.umrf)).toContain('"0.9"');
  expect(JSON.stringify(sent.umrf)).not.toContain("Theirs");
  await page.keyboard.press("Control+.");
  await expect.poll(async () => (await newest())?.state).toBe("stopped");
  expect(failures).toEqual([]);
  await context.close();
});
