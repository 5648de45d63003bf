/** A robot that takes only released versions, asks who watches it, and for a Stop drill; a drill is recorded. */

import { expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);

const product = new Product();
const david = new StandIn("David");
let ada: Person;
let graph: string;

const button = (page: Page, name: string | RegExp) => page.getByRole("button", { name });

/** Takes pictures where somebody wants to look at them. */
async function picture(page: Page, name: string, { phone = true } = {}): Promise<void> {
  const folder = process.env.DRILL_PICTURES;
  if (!folder) return;
  await page.screenshot({ path: `${folder}/${name}.png` });
  if (!phone) return;
  await page.setViewportSize({ width: 390, height: 844 });
  await page.screenshot({ path: `${folder}/${name}-phone.png` });
  await page.setViewportSize({ width: 1280, height: 720 });
}

async function asked(path: string, method: string, body: unknown, base: string): Promise<void> {
  const headers = { "content-type": "application/json" };
  await product.ask(path, { method, body: JSON.stringify(body), headers }, base);
}

test.beforeAll(async ({ browser }) => {
  david.start(product.data, { "*": { after_s: 60 } });
  await product.start();
  const registered = { name: david.name, domain: DOMAIN, get_service: david.path };
  await asked("/api/robots", "POST", registered, product.runnerUrl);
  const rules = { watched: true, drill_days: 30, released_only: true };
  await asked("/api/robots/David/rights", "PUT", rules, product.runnerUrl);
  graph = await product.chain(1);
  await asked(`/api/graphs/${graph}/versions`, "POST", {}, product.url);
  ada = await product.person(browser, "Ada");
});

test.afterAll(async () => {
  await david.kill();
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

test("a released version starts for a drill while somebody watches, and the drill is kept", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("radiogroup", { name: "What is listed" }).getByText("History").click();
  await page.getByRole("radiogroup", { name: "What of the history" }).getByText("Versions").click();
  await button(page, "v1").first().click();
  await button(page, "Release v1").click();
  const versions = page.getByRole("list", { name: "Versions" });
  await expect(versions).toContainText("Released by Ada");

  // A withdrawal of which the runner did not hear is offered again, whatever the editor shows by then.
  await page.route("**/api/releases/*", (route) => route.abort());
  await button(page, "Withdraw the release of v1").click();
  await expect(versions).not.toContainText("Released by Ada");
  await page.unroute("**/api/releases/*");
  await button(page, "Withdraw the release of v1 again").click();
  await button(page, "Release v1").click();
  await expect(versions).toContainText("Released by Ada");
  await picture(page, "history");
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await button(page, "Choose where to start").click();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  const looks = page.getByRole("list", { name: "Looked at on David" });
  await expect(looks).toContainText("No Stop drill of David has been made", { timeout: 30_000 });
  await expect(looks).toContainText("This version was released by Ada");
  await expect(button(page, /Start v\d: Say that you watch David/)).toBeDisabled();
  await page.getByRole("checkbox", { name: /^I watch David/ }).check();
  await expect(button(page, /A check prevents the start/)).toBeDisabled();

  // The word is about the robot that was chosen when it was given: chosen again, it is asked anew.
  await page.getByRole("checkbox", { name: /^David/ }).uncheck();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  await expect(page.getByRole("checkbox", { name: /^I watch David/ })).not.toBeChecked();
  await page.getByRole("checkbox", { name: /^I watch David/ }).check();
  await page.getByRole("checkbox", { name: /^This start is for a Stop drill/ }).check();
  await expect(looks).toContainText("You watch David");
  const start = button(page, /^Start v\d on David/);
  await expect(start).toBeEnabled({ timeout: 20_000 });
  await picture(page, "start", { phone: false });
  await start.focus();
  await page.keyboard.down("Enter");
  await expect(page.getByRole("dialog")).toBeHidden();
  await page.keyboard.up("Enter");
  type Told = { state: string; actions?: Record<string, { state: string }> };
  const state = async () =>
    (await product.ask<Told[]>("/api/runs", {}, product.runnerUrl))[0]?.state ?? "";
  await expect.poll(state, { timeout: 20_000 }).toBe("running");
  await product.ask("/api/stop", { method: "POST" }, product.runnerUrl);
  await expect.poll(state, { timeout: 20_000 }).toBe("stopped");
  await page.goto(`${product.url}/robots`);
  const card = page.getByRole("article", { name: "David" });
  await expect(card).toContainText("No Stop drill of David has been made");
  await card.getByRole("button", { name: "Record a Stop drill …" }).click();
  const form = page.getByRole("dialog");
  await expect(form.getByRole("button", { name: "Record" })).toBeDisabled();
  for (const question of ["Did you see David stop?", "Did you try its hardware stop?"])
    await form.getByRole("radiogroup", { name: question }).getByText("Yes").click();
  await picture(page, "form");
  await form.getByRole("button", { name: "Record" }).click();
  const drills = card.getByRole("region", { name: "Stop drills of David" });
  await expect(drills).toContainText(/Ada, run 1: passed: rest proven after \d+\.\d\d s/);
  await expect(card).not.toContainText("No Stop drill of David has been made");
  await picture(page, "robot");
});
