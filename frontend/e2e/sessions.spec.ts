/** A session that ends while the page is open: edits stay, Stop works, signing in again goes on. */

import { createHash, createHmac } from "node:crypto";
import { type BrowserContext, expect, test } from "@playwright/test";
import { add, card, saved, start } from "./canvas";
import { LONG, Product, TOKEN } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const text = (raw: Buffer | string) => Buffer.from(raw).toString("base64url");

/** The cookie as the server seals it, with another end: seconds from now. */
async function endSession(context: BrowserContext, seconds: number): Promise<void> {
  const name = `aa_${product.port}`;
  const [cookie] = (await context.cookies()).filter((each) => each.name === name);
  if (cookie === undefined) throw new Error("nobody is signed in");
  const fields = JSON.parse(
    Buffer.from(cookie.value.split(".")[0] ?? "", "base64url").toString(),
  ) as [string, string, string, number];
  fields[3] = Date.now() / 1000 + seconds;
  const payload = text(JSON.stringify(fields));
  const seal = createHash("sha256").update(`action-assistant session\0${TOKEN}`).digest();
  const signature = text(createHmac("sha256", seal).update(payload).digest());
  await context.addCookies([{ ...cookie, value: `${payload}.${signature}` }]);
}

test("edits stay, Stop stops by POST, and the page goes on where it was", async ({ browser }) => {
  test.setTimeout(120_000);
  const { page, context, failures } = await product.person(browser, "Ada");
  const graph = await product.chain(60);
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await start(page);
  const running = page.locator(".react-flow__node-action").filter({ hasText: "running" });
  await expect(running.first()).toBeVisible();
  await page.evaluate(() => Object.assign(window, { samePage: true }));

  // The session ends, and every socket with it.
  await endSession(context, -60);
  await context.setOffline(true);
  await expect(page.getByText(/offline/i).first()).toBeVisible({ timeout: 45_000 });
  await context.setOffline(false);
  const bar = page.getByRole("form", { name: "Sign in again" });
  await expect(bar).toBeVisible({ timeout: 20_000 });

  // What is drawn now stays; Stop is heard.
  await add(page, "Later");
  await page.getByRole("button", { name: /^Stop / }).click();
  await expect
    .poll(async () => {
      const runs = `/api/runs?graph=${graph}`;
      return (await product.ask<{ state: string }[]>(runs, {}, product.runnerUrl))[0]?.state;
    })
    .toBe("stopped");
  await expect(bar).toBeVisible();

  // A wrong link is refused in place; the same person signs in again (here: with another tab).
  await bar.getByLabel("Link or token").fill("http://nowhere/#t=wrong");
  await bar.getByRole("button", { name: "Sign in" }).click();
  await expect(bar).toContainText("This is not the token of this server.");
  await endSession(context, 3600);
  await expect(bar).toBeHidden({ timeout: 15_000 });
  await saved(page);
  await expect(card(page, "Later")).toBeVisible();
  expect(await page.evaluate(() => Reflect.get(window, "samePage"))).toBe(true);
  const { actions } = await product.ask<{ actions: { name: string }[] }>(
    `/api/graphs/${graph}/umrf`,
  );
  expect(actions.map((action) => action.name)).toContain("Later");
  await expect(page.getByRole("button", { name: /^Stop everything/ })).toContainText(
    "nothing runs",
  );
  expect(failures).toEqual([]);
  await context.close();
});

test("the pasted link signs in again in place", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context } = await product.person(browser, "Ada");
  await page.evaluate(() => Object.assign(window, { samePage: true }));
  await context.clearCookies();
  const bar = page.getByRole("form", { name: "Sign in again" });
  await expect(bar).toBeVisible({ timeout: 20_000 });
  await expect(page.getByText("valve_inspection").first()).toBeVisible();
  await bar.getByLabel("Link or token").fill(`${product.url}/#t=${TOKEN}`);
  await bar.getByRole("button", { name: "Sign in" }).click();
  await expect(bar).toBeHidden();
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  await saved(page);
  expect(await page.evaluate(() => Reflect.get(window, "samePage"))).toBe(true);
  await context.close();
});

test("signing out ends the session everywhere, also for a copy of its cookie", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  const cookies = (await context.cookies()).map((each) => `${each.name}=${each.value}`).join("; ");
  const asked = (url: string) => fetch(url, { headers: { cookie: cookies } });
  const places = [`${product.url}/api/graphs`, `${product.runnerUrl}/api/runs`];
  for (const place of places) expect((await asked(place)).status).toBe(200);
  await page.getByRole("button", { name: /^You are Ada/ }).click();
  await page.getByRole("button", { name: "Sign out" }).click();
  await expect(page.getByLabel("Link, code or token")).toBeVisible();
  // What tells this browser from others stays: it signs nobody in.
  const names = (await context.cookies()).map(({ name }) => name);
  expect(names.filter((name) => /^aa_\d+$/.test(name))).toEqual([]);
  for (const place of places) expect((await asked(place)).status).toBe(401);
  await context.close();
});
