/** Two people, a robot with a baton that takes only what a second person has said yes to, and its queue: who
 * starts is told who waits, waits too, and gets at the turn what is missing; answers get lost on the way. */

import { type Browser, expect, type Page, type Route, test } from "@playwright/test";
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
let first: string;

interface Queue {
  entries: { id: string; author: { name: string } }[];
}

function send<T>(method: string, path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method, body: JSON.stringify(body), headers }, base);
}

const queue = () => product.ask<Queue>("/api/queue", {}, product.runnerUrl);
const runs = () => product.ask<{ state: string }[]>("/api/runs", {}, product.runnerUrl);
const notice = (page: Page) => page.getByRole("region", { name: "Starts without an answer" });
const turn = (page: Page) => page.getByRole("region", { name: "Before the start of chain_1" });

/** A person who came by a link for them alone, and is no owner. */
async function personally(browser: Browser, name: string, width: number): Promise<Person> {
  const person = { name, role: "operator" };
  const made = await send<{ links: { path: string }[] }>(
    ...(["POST", "/api/members", person, product.url] as const),
  );
  const context = await browser.newContext({ viewport: { width, height: 760 } });
  const page = await context.newPage();
  const failures: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  await page.goto(`${product.url}${made.links[0]?.path}`);
  await page.getByRole("button", { name: /^Come in as/ }).click();
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  return { context, page, failures };
}

/** Let the runner have what is posted to a path, and lose its answer, until the routes are taken away. */
async function loseAnswers(page: Page, path: string): Promise<string[]> {
  const sent: string[] = [];
  const lose = async (route: Route) => {
    if (route.request().method() !== "POST") return route.fallback();
    sent.push(route.request().postData() ?? "");
    await route.fetch();
    await route.abort("connectionreset");
  };
  await page.route(`${product.runnerUrl}${path}`, lose);
  return sent;
}

async function openStart(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  const looks = page.getByRole("list", { name: "Looked at on David" });
  await expect(looks.getByText("A stop can be proven")).toBeVisible({ timeout: 30_000 });
}

/** Takes a picture where somebody wants to look at it. */
async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env.QUEUE_PICTURES;
  if (folder) await page.screenshot({ path: `${folder}/${name}.png` });
}

const isTooWide = (page: Page) =>
  page.evaluate(() => document.documentElement.scrollWidth > window.innerWidth);

test.beforeAll(async ({ browser }) => {
  david.start(product.data, { "*": { after_s: 1 } });
  await product.start();
  const robot = { name: david.name, domain: DOMAIN, get_service: david.path };
  await send("POST", "/api/robots", { ...robot, profile: { second_person: true } });
  await send("PUT", "/api/robots/David/rights", { baton: true });
  graph = await product.chain(1);
  const made = `/api/graphs/${graph}/versions`;
  const version = await send<{ id: string; digest: string; umrf: object }>(
    ...(["POST", made, {}, product.url] as const),
  );
  const { id, digest, umrf } = version;
  const start = { version: id, digest, umrf, graph, engine: david.name, request_id: "first" };
  await expect(async () => {
    first = (await send<Queue>("POST", "/api/queue", { start })).entries[0]?.id ?? "";
  }).toPass({ timeout: 30_000 });
  ada = await personally(browser, "Ada", 360);
  ben = await personally(browser, "Ben", 1440);
  // Its card stood nowhere: Ben's page places it, after it has given Ada's page, the first one there, its turn.
  const moment = async () => (await product.ask<{ seq: number }>(`/api/graphs/${graph}`)).seq;
  await expect.poll(moment).toBe(2);
});

test.afterAll(async () => {
  await david.kill();
  expect([...ada.failures, ...ben.failures]).toEqual([]);
  for (const { context } of [ada, ben]) await context.close();
  await product.dispose();
});

test("who starts is told who waits, and waits too, once, although the answer gets lost", async () => {
  const { page } = ada;
  const sent = await loseAnswers(page, "/api/queue");
  await openStart(page);
  const wait = page.getByRole("region", { name: "Wait" });
  await expect(wait).toContainText("1 start waits for David: chain_1");
  await expect(wait).toContainText("A start now goes before it.");
  await wait.scrollIntoViewIfNeeded();
  await picture(page, "others-360");
  expect(await isTooWide(page)).toBe(false);
  await wait.getByRole("button", { name: "Wait in the queue" }).click();
  await expect(notice(page)).toContainText("v2 of chain_1 was put into the queue after all.");
  await expect(page.getByRole("dialog")).toBeHidden();
  await picture(page, "lost-360");
  await page.unrouteAll();
  await openStart(page);
  await wait.getByRole("button", { name: "Wait in the queue" }).click();
  await expect(page).toHaveURL(/\/runs\/queue$/);
  await expect(notice(page)).toBeHidden();
  expect(sent).toHaveLength(1);
  const { entries } = await queue();
  expect(entries[1]?.author.name).toBe("Ada");
  expect(entries).toHaveLength(2);
});

test("at its turn the baton is taken and the second person is asked where the start is looked at", async () => {
  await send("POST", `/api/queue/${first}/remove`, {});
  const { page } = ada;
  await turn(page).getByRole("button", { name: "Look before the start" }).click();
  await expect(turn(page)).toContainText("In the way: Nobody holds the baton of David");
  await expect(turn(page)).toContainText("nobody else has said yes to exactly this start");
  await expect(turn(page).getByRole("button", { name: /A check prevents/ })).toBeDisabled();
  await picture(page, "turn-360");
  await turn(page).getByRole("button", { name: "Take the baton" }).click();
  const closed = page.getByRole("region", { name: "The queue of David" });
  await expect(closed).toContainText("The baton of David changed hands.");
  await picture(page, "closed-360");
  await closed.getByRole("button", { name: "Look again, and open it" }).click();
  await turn(page).getByRole("button", { name: "Look before the start" }).click();
  await expect(turn(page)).toContainText("nobody else has said yes to exactly this start");
  await expect(turn(page)).not.toContainText("baton of David");
  await turn(page).getByRole("button", { name: "Ask others for their yes" }).click();
  await expect(turn(page)).toContainText(
    "They see it where they start the graph, or in the queue.",
  );
  await picture(page, "asked-360");
  const other = ben.page;
  await other.goto(`${product.url}/runs/queue`);
  await turn(other).getByRole("button", { name: "Look before the start" }).click();
  await expect(turn(other)).toContainText("Ada has its baton");
  await picture(other, "other-1440");
  await turn(other)
    .getByRole("button", { name: /^Say yes to v2/ })
    .click();
  await expect(turn(other)).toContainText("You said yes to v2: somebody else may start it.");
  await expect(turn(page)).toContainText("Ben said yes to exactly this start.");
  await expect(turn(page).getByRole("button", { name: "Ask others for their yes" })).toBeHidden();
  await picture(page, "ready-360");
  expect(await isTooWide(page)).toBe(false);
});

test("a start at its turn whose answer gets lost is found, and is the only one", async () => {
  const { page } = ada;
  const sent = await loseAnswers(page, "/api/queue/*/start");
  const start = turn(page).getByRole("button", { name: "Start chain_1 on David" });
  await start.focus();
  await page.keyboard.down("Enter");
  await expect(notice(page)).toContainText(/Started after all: run \d+ on David/);
  await page.keyboard.up("Enter");
  await picture(page, "started-360");
  expect(sent).toHaveLength(1);
  expect((await queue()).entries).toEqual([]);
  await expect.poll(async () => (await runs()).map(({ state }) => state)).toEqual(["finished"]);
});
