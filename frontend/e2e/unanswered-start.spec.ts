/** A start whose answer never comes: the page does not claim that it was not started, it looks. */

import { expect, type Page, type Route, test } from "@playwright/test";
import { saved, start } from "./canvas";
import { type Person, Product } from "./product";
import { anotherDay } from "./turns";

const product = new Product();
let ada: Person;

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

interface Run {
  id: string;
  number: number;
  state: string;
}

const runs = () => product.ask<Run[]>("/api/runs", {}, product.runnerUrl);
const notice = (page: Page) => page.getByRole("region", { name: "Starts without an answer" });

/** Every start that leaves the page, and what becomes of it on its way. */
async function underWay(page: Page, then: (route: Route) => Promise<void>): Promise<string[]> {
  const sent: string[] = [];
  await page.route(`${product.runnerUrl}/api/runs`, async (route) => {
    if (route.request().method() !== "POST") return route.fallback();
    sent.push(route.request().postData() ?? "");
    await then(route);
  });
  return sent;
}

async function open(page: Page): Promise<void> {
  await page.goto(`${product.url}/graphs/${await product.chain(60)}`);
  await saved(page);
}

async function stopAll(page: Page): Promise<void> {
  await page.keyboard.press("Control+.");
  await expect.poll(async () => (await runs())[0]?.state).toBe("stopped");
}

test("its answer gets lost: the run is found by its request, and nothing is sent again", async () => {
  const { page } = ada;
  await open(page);
  const before = (await runs()).length;
  const sent = await underWay(page, async (route) => {
    await route.fetch(); // the runner has it, and the answer is lost
    await route.abort("connectionreset");
  });
  await start(page);
  await expect(notice(page)).toContainText(/Started after all: run \d+/);
  await expect(page.getByText("Not started")).toHaveCount(0);
  expect(sent).toHaveLength(1);
  expect(await runs()).toHaveLength(before + 1);
  await page.unrouteAll();
  await stopAll(page);
  await notice(page).getByRole("button", { name: "Hide" }).click();
  await expect(notice(page)).toHaveCount(0);
  await page.reload();
  await saved(page);
  await expect(notice(page)).toHaveCount(0);
});

test("the page is loaded again before the answer is there", async () => {
  test.skip(anotherDay(0) !== "", anotherDay(0));
  const { page } = ada;
  await open(page);
  let reached: (() => void) | undefined;
  const arrived = new Promise<void>((done) => {
    reached = done;
  });
  const sent = await underWay(page, async (route) => {
    await route.fetch();
    reached?.(); // and never answered
  });
  await start(page);
  await arrived;
  await page.reload();
  await expect(notice(page)).toContainText(/Started after all: run \d+/);
  expect(sent).toHaveLength(1);
  await page.unrouteAll({ behavior: "ignoreErrors" });
  await stopAll(page);
});

test("it never arrives: that is not known, and so it is said, for as long as it takes", async () => {
  test.skip(anotherDay(1) !== "", anotherDay(1));
  const { page } = ada;
  await page.evaluate(() => sessionStorage.removeItem("aa.starts"));
  await open(page);
  const before = (await runs()).length;
  const sent = await underWay(page, (route) => route.abort("connectionreset"));
  await start(page);
  await expect(notice(page)).toContainText("NOT KNOWN whether v1 of chain_60 started");
  await expect(notice(page)).toContainText("knows nothing of this start so far");
  await expect(notice(page)).toContainText("does not send it again");
  await page.screenshot({ path: test.info().outputPath("unsure.png") });
  expect(sent).toHaveLength(1);
  expect(await runs()).toHaveLength(before);
  await page.unrouteAll();
  await notice(page).getByRole("button", { name: "Hide" }).click();
  await expect(notice(page)).toHaveCount(0);
});

test("what the runner refuses was not started, and that is certain", async () => {
  test.skip(anotherDay(2) !== "", anotherDay(2));
  const { page } = ada;
  await open(page);
  await underWay(page, (route) =>
    route.fulfill({
      status: 409,
      contentType: "application/problem+json",
      headers: {
        "access-control-allow-origin": product.url,
        "access-control-allow-credentials": "true",
      },
      body: JSON.stringify({ type: "conflict", title: "No", status: 409, detail: "It is taken." }),
    }),
  );
  await start(page);
  await expect(page.getByText("Not started")).toBeVisible();
  await expect(notice(page)).toHaveCount(0);
  await page.unrouteAll();
});

test("what was asked for without a network is not sent when there is one again", async () => {
  const { page, context } = ada;
  await open(page);
  const before = (await runs()).length;
  const sent: string[] = [];
  page.on("request", (request) => {
    if (request.method() === "POST") sent.push(request.url());
  });
  await context.setOffline(true);
  await start(page);
  await expect(page.getByText(/Not started|NOT KNOWN/).first()).toBeVisible();
  const tried = sent.length;
  await context.setOffline(false);
  await saved(page);
  expect(sent.slice(tried)).toEqual([]);
  expect(await runs()).toHaveLength(before);
  // A start of now is the first that arrives, and stays the only one.
  await start(page);
  await expect.poll(async () => (await runs()).length).toBe(before + 1);
  await stopAll(page);
  expect(await runs()).toHaveLength(before + 1);
});

test("a browser that believes to be without a network holds nothing back", async () => {
  test.skip(anotherDay(0) !== "", anotherDay(0));
  const { page } = ada;
  await open(page);
  await page.evaluate(() => window.dispatchEvent(new Event("offline")));
  await start(page);
  await expect.poll(async () => (await runs())[0]?.state).toBe("running");
  await page.evaluate(() => window.dispatchEvent(new Event("online")));
  await stopAll(page);
});
