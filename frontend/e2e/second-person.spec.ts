/** A robot that takes only what a second person has said yes to: one asks, the other says yes, it starts. */

import { type Browser, expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const david = new StandIn("David");
let ada: Person;
let ben: Person;
let graph: string;

const dialog = (page: Page) => page.getByRole("dialog");
const lookedAt = (page: Page) => page.getByRole("list", { name: "Looked at on David" });
const yes = (page: Page) => dialog(page).getByRole("button", { name: /^Say yes to v1/ });

/** A person who came by a link for them alone. */
async function personally(browser: Browser, name: string): Promise<Person> {
  const made = await product.ask<{ links: { path: string }[] }>("/api/members", {
    method: "POST",
    body: JSON.stringify({ name, role: "operator" }),
    headers: { "content-type": "application/json" },
  });
  const context = await browser.newContext();
  const page = await context.newPage();
  const failures: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  await page.goto(`${product.url}${made.links[0]?.path}`);
  await page.getByRole("button", { name: /^Come in as/ }).click();
  await page.getByRole("button", { name: /^You are / }).waitFor();
  return { context, page, failures };
}

async function openStart(page: Page, of = graph): Promise<void> {
  await page.goto(`${product.url}/graphs/${of}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  await expect(lookedAt(page).getByText("A stop can be proven")).toBeVisible({ timeout: 30_000 });
}

test.beforeAll(async ({ browser }) => {
  david.start(product.data, { "*": { after_s: 1 } });
  await product.start();
  const robot = { name: david.name, domain: DOMAIN, get_service: david.path };
  await product.ask(
    "/api/robots",
    {
      method: "POST",
      body: JSON.stringify({ ...robot, profile: { second_person: true } }),
      headers: { "content-type": "application/json" },
    },
    product.runnerUrl,
  );
  graph = await product.chain(1);
  ada = await personally(browser, "Ada");
  ben = await personally(browser, "Ben");
});

test.afterAll(async () => {
  await david.kill();
  expect([...ada.failures, ...ben.failures]).toEqual([]);
  for (const { context } of [ada, ben]) await context.close();
  await product.dispose();
});

test("nobody starts alone, also who has said yes", async () => {
  const { page } = ada;
  await openStart(page);
  await expect(lookedAt(page)).toContainText("nobody else has said yes to exactly this graph");
  await expect(page.getByRole("button", { name: /A check prevents the start/ })).toBeDisabled();
  await yes(page).click();
  await expect(dialog(page)).toContainText("You said yes to v1: somebody else may start it.");
  await dialog(page).getByRole("button", { name: "Look again" }).click();
  await expect(lookedAt(page)).toContainText("nobody else has said yes to exactly this graph");
});

test("what another has said yes to starts", async () => {
  await openStart(ben.page);
  await expect(lookedAt(ben.page)).toContainText("Ada said yes to exactly this graph.");
  await yes(ben.page).click();
  const { page } = ada;
  await expect(lookedAt(page)).toContainText("Ben said yes to exactly this graph.", {
    timeout: 20_000,
  });
  const start = page.getByRole("button", { name: /^Start v1 on David/ });
  await expect(start).toBeEnabled();
  await start.focus();
  await page.keyboard.down("Enter");
  await expect(dialog(page)).toBeHidden();
  await page.keyboard.up("Enter");
  const state = async () =>
    (await product.ask<{ state: string }[]>("/api/runs", {}, product.runnerUrl))[0]?.state;
  await expect.poll(state, { timeout: 20_000 }).toBe("finished");
});

test("others say yes to a graph that was never started before they choose a robot", async () => {
  const other = await product.chain(3);
  const { page } = ada;
  await openStart(page, other);
  await dialog(page).getByRole("button", { name: "Ask others for their yes" }).click();
  await expect(dialog(page)).toContainText("They see it where they start the graph");
  await ben.page.goto(`${product.url}/graphs/${other}`);
  await saved(ben.page);
  await ben.page.getByRole("button", { name: "Choose where to start" }).click();
  const asked = ben.page.getByRole("region", { name: /Ada.* asks for a second person/ });
  await expect(asked).toContainText("for David: v1.");
  await asked.getByRole("button", { name: /^Say yes to exactly this/ }).click();
  await expect(lookedAt(page)).toContainText("Ben said yes to exactly this graph.", {
    timeout: 20_000,
  });
  await page.keyboard.press("Escape");
});

test("a yes to single starts is none to a repeat: all of it is asked, and read on a phone", async () => {
  const { page } = ada;
  await openStart(page);
  await dialog(page).getByRole("checkbox", { name: "Repeat it" }).check();
  await dialog(page)
    .getByRole("button", { name: /^Repeat v1 on David: 3 runs/ })
    .click();
  await expect(page).toHaveURL(/\/runs\/repeats\//);
  const first = page.getByRole("button", { name: /^Start run 1 of 3/ });
  await expect(first).toBeEnabled();
  const asks = page.getByRole("region", { name: "A second person" });
  await expect(asks).toContainText("3 runs in 3 rounds, each by a press", { timeout: 20_000 });
  await first.focus();
  await page.keyboard.down("Enter");
  await expect(page.getByRole("alert")).toContainText("nobody else has said yes to exactly this");
  await page.keyboard.up("Enter");
  await asks.getByRole("button", { name: "Ask others for their yes" }).click();

  const phone = ben.page;
  await phone.setViewportSize({ width: 360, height: 740 });
  await openStart(phone);
  const asked = phone.getByRole("region", { name: /Ada.* asks for a second person/ });
  await expect(asked).toContainText("3 runs in 3 rounds, each by a press");
  await expect(asked).toContainText("none in force");
  await asked.scrollIntoViewIfNeeded();
  await phone.screenshot({ path: test.info().outputPath("asked-360.png") });
  await asked.getByRole("button", { name: /^Say yes to exactly this/ }).click();
  await expect(asked).toContainText("You said yes to exactly this.");

  await expect(asks).toContainText("Said yes to all of 3 runs", { timeout: 20_000 });
  await first.focus();
  await page.keyboard.down("Enter");
  await expect(page.getByRole("cell", { name: /^Run \d+/ })).toBeVisible({ timeout: 20_000 });
  await page.keyboard.up("Enter");
  await page.screenshot({ path: test.info().outputPath("repeat-1440.png"), fullPage: true });
});
