/** Stop whatever else is broken: the editor frozen or dead, ten tabs, a full disk, no runner. */

import { execFileSync } from "node:child_process";
import { expect, type Page, type Request, test } from "@playwright/test";
import { boxOf, saved, start } from "./canvas";
import { Product } from "./product";
import { anotherDay } from "./turns";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

interface Run {
  state: string;
  ended_at: string | null;
}

const states = async () => {
  const runs = await product.ask<Run[]>("/api/runs", {}, product.runnerUrl);
  return runs.map((run) => run.state);
};

/** A run that goes on for a minute, seen by a page. */
async function running(page: Page): Promise<void> {
  await page.goto(`${product.url}/graphs/${await product.chain(60)}`);
  await saved(page);
  await start(page);
  await expect.poll(async () => (await states())[0]).toBe("running");
  await expect(page.getByRole("button", { name: /^Stop run/ })).toBeVisible();
}

/** At each width: what is said of the runner lies on no tool, and on STOP nothing is cut off. */
async function nothingCovered(page: Page): Promise<void> {
  const { width: before = 0, height = 0 } = page.viewportSize() ?? {};
  const status = page.getByRole("status");
  for (const width of [1280, 1100, 820]) {
    await page.setViewportSize({ width, height });
    await expect(async () => {
      const said = await boxOf(status.filter({ hasText: "Runner unknown since" }));
      const tools = await boxOf(page.getByRole("toolbar", { name: "Canvas tools" }));
      expect(said.x >= tools.x + tools.width || said.y + said.height <= tools.y).toBe(true);
      const stop = await boxOf(page.getByRole("button", { name: /^Stop / }).first());
      const words = await boxOf(page.getByText("state unknown"));
      expect(words.x).toBeGreaterThan(stop.x + 2);
      expect(words.x + words.width).toBeLessThan(stop.x + stop.width - 2);
      expect(words.y + words.height).toBeLessThan(stop.y + stop.height);
    }, `at ${width} px`).toPass({ timeout: 10_000 });
  }
  await page.setViewportSize({ width: before, height });
}

test("while the editor is frozen, and after it has died", async ({ browser }) => {
  const { page, failures } = await product.person(browser, "Ada");
  await running(page);
  const editor = product.pid("editor");
  process.kill(editor, "SIGSTOP");
  try {
    await page.getByRole("button", { name: /^Stop run/ }).click();
    await expect.poll(async () => (await states())[0]).toBe("stopped");
    await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
  } finally {
    process.kill(editor, "SIGCONT");
  }
  await running(page);
  process.kill(product.pid("editor"), "SIGKILL");
  await page.keyboard.press("Control+.");
  await expect.poll(async () => (await states())[0]).toBe("stopped");
  expect(failures).toEqual([]);
  await product.untilReady();
  await page.context().close();
});

test("with ten tabs open, from the tenth, while a dialog is open and somebody types", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  await running(page);
  for (let i = 0; i < 8; i += 1) await (await context.newPage()).goto(`${product.url}/robots`);
  const tenth = await context.newPage();
  await tenth.goto(`${product.url}/robots`);
  await tenth.getByRole("button", { name: "Register a robot" }).click();
  await tenth.getByRole("textbox", { name: "Name" }).pressSequentially("Da");
  await tenth.keyboard.press("Control+.");
  await expect.poll(async () => (await states())[0]).toBe("stopped");
  await expect(tenth.getByRole("textbox", { name: "Name" })).toHaveValue("Da");
  await expect(page.getByText("stopped by Ada").first()).toBeVisible();
  await context.close();
});

test("while it cannot be sent the page says so, and goes on trying until it is proven", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  await running(page);
  const drawnAt = async () => (await boxOf(page.getByRole("region", { name: "Graph" }))).y;
  const before = await drawnAt();
  const runner = product.pid("runner");
  process.kill(runner, "SIGSTOP");
  const isStop = (request: Request) =>
    request.method() === "POST" && new URL(request.url()).pathname.endsWith("/stop");
  try {
    const failed = page.waitForEvent("requestfailed", isStop);
    await page
      .getByRole("button", { name: /^Stop / })
      .first()
      .click();
    const alert = page.getByRole("alert").filter({ hasText: "NOT SENT: use the hardware stop" });
    await expect(alert).toBeVisible();
    expect(await drawnAt()).toBe(before); // what is drawn stays under the hand
    // One try has got no answer in its time, and the next one is sent.
    await failed;
    await page.waitForRequest(isStop);
    await expect(alert).toBeVisible();
    await nothingCovered(page);
    // Neither the bar, the list, the strip nor a card says that it runs: nobody knows.
    await expect(page.getByText(/(^|· )running/i)).toHaveCount(0);
  } finally {
    process.kill(runner, "SIGCONT");
  }
  await expect.poll(async () => (await states())[0], { timeout: 20_000 }).toBe("stopped");
  await expect(page.getByText("stopped by Ada").first()).toBeVisible();
  await context.close();
});

test("while the runner's disk is full, and the page says that it is not recorded", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await running(page);
  const files = (longest: string) =>
    execFileSync("prlimit", ["--pid", String(product.pid("runner")), `--fsize=${longest}`]);
  files("0:unlimited"); // whatever it writes now fails
  try {
    await page.keyboard.press("Control+.");
    await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
    await expect(page.getByText("not recorded")).toBeVisible();
    await start(page); // nothing is sent that could not be recorded
    await expect(page.getByText("Not started")).toBeVisible();
  } finally {
    files("unlimited:unlimited");
  }
  await expect(page.getByText("not recorded")).toBeHidden();
  await expect.poll(async () => (await states())[0]).toBe("stopped");
  expect(failures).toEqual([]);
  await context.close();
});

test("in sight on every width, whatever else the bar has to say", async ({ browser }) => {
  test.skip(anotherDay(2) !== "", anotherDay(2));
  test.slow(); // eight widths of a page that draws sixty running actions without a GPU
  const { page, context, failures } = await product.person(browser, "Ada Lovelace");
  await running(page);
  // She is there to be named in the bar: drawing her canvas would take what this one needs.
  const mari = await product.person(browser, "Mari Kask", {
    viewport: { width: 320, height: 240 },
  });
  await mari.page.goto(page.url());
  const id = page.url().split("/").at(-1);
  const name = "inspection of the north hall with a long name";
  const headers = { "content-type": "application/json" };
  const body = JSON.stringify({ name });
  await product.ask(`/api/graphs/${id}`, { method: "PATCH", headers, body });
  await expect(page.getByText("Graph differs from running")).toBeVisible();
  for (const width of [1600, 1440, 1280, 1101, 1024, 801, 640, 390]) {
    await page.setViewportSize({ width, height: 400 });
    await expect(async () => {
      const box = await page.getByRole("button", { name: /^Stop run/ }).boundingBox();
      expect(box).not.toBeNull();
      expect(box?.x).toBeGreaterThanOrEqual(0);
      expect((box?.x ?? 0) + (box?.width ?? 0)).toBeLessThanOrEqual(width);
    }, `at ${width} px`).toPass({ timeout: 10_000 });
  }
  await page.getByRole("button", { name: /^Stop run/ }).click();
  await expect.poll(async () => (await states())[0]).toBe("stopped");
  expect([...failures, ...mari.failures]).toEqual([]);
  await mari.context.close();
  await context.close();
});
