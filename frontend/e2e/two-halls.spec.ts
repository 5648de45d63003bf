/** A page with the runners of two halls: robots of both, a run on each, and STOP ALL while one is frozen. */

import { expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { DOMAIN, NO_ROS, SECOND_DOMAIN, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";
import { SecondRunner, startTwoHalls } from "./second-runner";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const second = new SecondRunner();
const carl = new StandIn("Carl");
const dora = new StandIn("Dora", "", SECOND_DOMAIN);
const SCRIPT = { "*": { after_s: 60, stop_s: 0.05 } };
let ada: Person;

test.beforeAll(async ({ browser }) => {
  for (const robot of [carl, dora]) robot.start(product.data, SCRIPT);
  await startTwoHalls(product, second);
  ada = await product.person(browser, "Ada");
});

test.afterAll(async () => {
  second.thaw();
  for (const each of [carl, dora]) await each.kill();
  await second.dispose();
  await product.dispose();
});

interface Run {
  id: string;
  state: string;
  engine: string;
}

const runsAt = (url: string) => product.ask<Run[]>("/api/runs", {}, url);
const stateAt = async (url: string, robot: string) =>
  (await runsAt(url)).find(({ engine }) => engine === robot)?.state;
const card = (page: Page, robot: string) => page.getByRole("article", { name: robot });
const alert = (page: Page) => page.getByRole("alert");

async function register(page: Page, robot: StandIn, hall: string, domain: number): Promise<void> {
  await page.getByRole("button", { name: "Register a robot" }).first().click();
  const form = page.getByRole("dialog");
  await form.getByRole("textbox", { name: "Name" }).fill(robot.name);
  await form.getByRole("combobox", { name: "Site" }).selectOption(hall);
  await form.getByRole("textbox", { name: "ROS domain" }).fill(String(domain));
  await form.getByRole("button", { name: /Path, middleware/ }).click();
  await form.getByRole("textbox", { name: /path/i }).first().fill(robot.path);
  await form.getByRole("button", { name: "Register", exact: true }).click();
}

async function startOn(page: Page, graph: string, robot: string): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  const dialog = page.getByRole("dialog");
  await dialog.getByRole("checkbox", { name: new RegExp(`^${robot}`) }).check();
  const button = dialog.getByRole("button", { name: new RegExp(`^Start v\\d+ on ${robot}`) });
  await expect(button).toBeEnabled({ timeout: 30_000 });
  await button.focus();
  await page.keyboard.down("Enter");
  await expect(dialog).toBeHidden();
  await page.keyboard.up("Enter");
}

test("robots are registered at their hall, and a name is taken once", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/robots`);
  await register(page, carl, "Hall A", DOMAIN);
  await register(page, dora, "Hall B", SECOND_DOMAIN);
  for (const robot of ["Carl", "Dora"]) {
    await expect(card(page, robot).getByText("A stop can be proven")).toBeVisible({
      timeout: 60_000,
    });
  }
  await expect(page.getByRole("heading", { name: /^Hall [AB]$/ })).toHaveText(["Hall A", "Hall B"]);
  const there = await product.ask<{ name: string }[]>("/api/robots", {}, second.url);
  expect(there.map(({ name }) => name)).toEqual(["simulator", "Dora"]);
  await register(page, dora, "Hall A", DOMAIN);
  await expect(page.getByRole("dialog").getByRole("alert")).toContainText("registered at Hall B");
  await page.keyboard.press("Escape");
});

test("a run goes on in each hall, and one list has both", async () => {
  const { page } = ada;
  await startOn(page, await product.chain(3), "Dora");
  await expect.poll(() => stateAt(second.url, "Dora")).toBe("running");
  await startOn(page, await product.chain(2), "Carl");
  await expect.poll(() => stateAt(product.runnerUrl, "Carl")).toBe("running");
  expect(await runsAt(product.runnerUrl)).toHaveLength(1);
  expect(await runsAt(second.url)).toHaveLength(1);
  await page.goto(`${product.url}/runs`);
  await expect(page.getByRole("row").filter({ hasText: "Dora · Hall B" })).toBeVisible();
  await expect(page.getByRole("row").filter({ hasText: "Carl · Hall A" })).toBeVisible();
  await page.getByRole("row").filter({ hasText: "Dora" }).getByRole("link").first().click();
  await expect(page.getByText("running").first()).toBeVisible();
  expect(ada.failures).toEqual([]);
});

test("a link to a run of the second hall shows it to somebody without a name", async ({
  browser,
}) => {
  const run = (await runsAt(second.url))[0]?.id ?? "";
  const init = {
    method: "POST",
    body: JSON.stringify({ thing: run, label: "visitor", days: 1 }),
    headers: { "content-type": "application/json" },
  };
  const { path } = await product.ask<{ path: string }>("/api/view-links", init, second.url);
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(product.url + path);
  await expect(page.getByText("running").first()).toBeVisible();
  await expect(page.getByText("Dora").first()).toBeVisible();
  await context.close();
});

test("STOP ALL stops one hall at once while the other is frozen, which is named", async ({
  browser,
}) => {
  const { page } = ada;
  const phone = await product.person(browser, "Phone", { viewport: { width: 360, height: 740 } });
  await phone.page.goto(`${product.url}/runs`);
  await page.goto(`${product.url}/robots`);
  await expect(page.getByRole("button", { name: /^Stop everything/ })).toContainText("2");
  second.freeze();
  try {
    await page.getByRole("button", { name: /^Stop everything/ }).click();
    await expect.poll(() => stateAt(product.runnerUrl, "Carl")).toBe("stopped");
    await expect(alert(page).filter({ hasText: /NOT SENT at .*Hall B/ })).toBeVisible();
    await expect(alert(page).filter({ hasText: /Hall A.*: Run 1: stopped/ })).toBeVisible();
    await expect(
      card(page, "Dora")
        .getByText(/does not answer/)
        .first(),
    ).toBeVisible();
    await expect(card(page, "Carl").getByText("answers", { exact: true })).toBeVisible();
    await expect(page.getByText(/^running/i)).toHaveCount(0);
    const said = alert(phone.page).filter({ hasText: /STOP MAY REACH NOBODY at .*Hall B/ });
    await expect(said).toBeVisible({ timeout: 20_000 });
    const box = await said.boundingBox();
    expect(box?.x).toBeGreaterThanOrEqual(0);
    expect((box?.x ?? 0) + (box?.width ?? 0)).toBeLessThanOrEqual(360);
    const stop = await phone.page
      .getByRole("button", { name: /^Stop / })
      .first()
      .boundingBox();
    expect((stop?.x ?? 0) + (stop?.width ?? 0)).toBeLessThanOrEqual(360);
    const overflow = await phone.page.evaluate(() => document.documentElement.scrollWidth);
    expect(overflow).toBeLessThanOrEqual(360);
  } finally {
    second.thaw();
  }
  await expect.poll(() => stateAt(second.url, "Dora"), { timeout: 30_000 }).toBe("stopped");
  await expect(alert(page).filter({ hasText: "Hall B" })).toHaveCount(0, { timeout: 20_000 });
  expect(ada.failures).toEqual([]);
});

test("STOP ALL reaches both halls while a part of the page does not load", async ({ browser }) => {
  const graph = await product.chain(3);
  await startOn(ada.page, graph, "Dora");
  await startOn(ada.page, await product.chain(2), "Carl");
  await expect.poll(() => stateAt(second.url, "Dora")).toBe("running");
  await expect.poll(() => stateAt(product.runnerUrl, "Carl")).toBe("running");
  const bob = await product.person(browser, "Bob");
  await bob.page.route(/assets\/live-sites-/, (route) => route.abort());
  await bob.page.goto(`${product.url}/robots`);
  const stop = bob.page.getByRole("button", { name: /^Stop everything/ });
  await expect(stop).toContainText("state unknown");
  await expect(alert(bob.page)).toContainText("STOP goes to each runner", { timeout: 20_000 });
  await stop.click();
  await expect.poll(() => stateAt(product.runnerUrl, "Carl")).toBe("stopped");
  await expect.poll(() => stateAt(second.url, "Dora")).toBe("stopped");
  const notice = bob.page.getByRole("status").filter({ hasText: /Hall A.*: Run \d+: stopped/ });
  await expect(notice.filter({ hasText: /Hall B.*: Run \d+: stopped/ })).toBeVisible();
  await bob.page.unroute(/assets\/live-sites-/);
  await expect(stop).toContainText("nothing runs", { timeout: 20_000 });
  expect(bob.failures).toEqual([]);
});

test("an open page hears of a third hall, and says that it has to be loaded again to reach it", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/robots`);
  await expect(page.getByRole("button", { name: /^Stop everything/ })).toContainText(
    "nothing runs",
  );
  const third = { name: "Hall C", url: `http://127.0.0.1:${second.port + 1}` };
  await page.route("**/api/config", async (route) => {
    const answer = await route.fetch();
    const config = await answer.json();
    await route.fulfill({ json: { ...config, runners: [...config.runners, third] } });
  });
  await page.getByRole("button", { name: /^Stop everything/ }).click();
  await expect(page.getByRole("heading", { name: "Hall C" })).toBeVisible();
  const said = alert(page).filter({ hasText: /NOT SENT at .*Hall C/ });
  await expect(said).toContainText("reload the page");
  await page.unroute("**/api/config");
  await page.reload();
  await expect(page.getByRole("heading", { name: "Hall B" })).toBeVisible();
  await expect(page.getByRole("heading", { name: "Hall C" })).toHaveCount(0);
});
