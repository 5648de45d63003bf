/** A start on two robots that waits in the queues of both, and is started by a hand when both are free. */
import { expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const robots = [new StandIn("David"), new StandIn("Carol")] as const;
let ann: Person;
let graph: string;

const dialog = (page: Page) => page.getByRole("dialog");
const turn = (page: Page) => page.getByRole("region", { name: /^Before the start of/ });
const runs = () =>
  product.ask<{ engine: string; state: string }[]>("/api/runs", {}, product.runnerUrl);

async function choose(page: Page, names: readonly RegExp[]): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  for (const name of names) await page.getByRole("checkbox", { name }).check();
}

async function held(page: Page, name: RegExp): Promise<void> {
  const start = page.getByRole("button", { name });
  await expect(start).toBeEnabled({ timeout: 30_000 });
  await start.focus();
  await page.keyboard.down("Enter");
}

test.beforeAll(async ({ browser }) => {
  // Carol's first action goes on until a page on a busy machine has put a start in the queue.
  for (const robot of robots)
    robot.start(product.data, {
      "*": [{ after_s: robot.name === "Carol" ? 20 : 1 }, { after_s: 1 }],
    });
  await product.start();
  for (const { name, path } of robots)
    await product.ask(
      "/api/robots",
      {
        method: "POST",
        body: JSON.stringify({ name, domain: DOMAIN, get_service: path }),
        headers: { "content-type": "application/json" },
      },
      product.runnerUrl,
    );
  graph = await product.chain(1);
  ann = await product.person(browser, "Ann");
});

test.afterAll(async () => {
  for (const robot of robots) await robot.kill();
  expect(ann.failures).toEqual([]);
  await ann.context.close();
  await product.dispose();
});

test("it waits for the busy one of its two robots, and one press starts both", async () => {
  const { page } = ann;
  await choose(page, [/^Carol/]);
  await held(page, /^Start v1 on Carol/);
  await expect(dialog(page)).toBeHidden();
  await page.keyboard.up("Enter");
  await choose(page, [/^Carol/, /^David/]);
  const wait = dialog(page).getByRole("region", { name: "Wait" });
  await wait.getByRole("button", { name: "Wait in the queue" }).click({ timeout: 30_000 });
  await expect(page).toHaveURL(/\/runs\/queue$/);
  await expect(page.getByRole("listitem").first()).toContainText("Carol is running");
  expect(await runs()).toHaveLength(1);
  await turn(page)
    .getByRole("button", { name: "Look before the start" })
    .click({ timeout: 60_000 });
  await page.screenshot({ path: test.info().outputPath("together-1440.png") });
  await held(page, /^Start chain_1 on Carol, David/);
  await expect(page).toHaveURL(/\/runs\/(?!queue)/, { timeout: 30_000 });
  await page.keyboard.up("Enter");
  const engines = (await runs()).map(({ engine }) => engine).sort();
  expect(engines).toEqual(["Carol", "Carol", "David"]);
});
