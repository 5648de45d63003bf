/** A graph of two robots, led step by step: started from the page, handed from one to the other, stopped. */

import { type Browser, expect, type Page, test } from "@playwright/test";
import { add, card, connect, enter, fitView, holdEnter, saved, setRobot } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { LONG, type Person, Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const carol = new StandIn("Carol");
const david = new StandIn("David");
let ada: Person;
let mari: Person;
let graph: string;

const dialog = (page: Page) => page.getByRole("dialog");
const moves = (page: Page) => page.getByRole("region", { name: "Moves now" });

function post<T>(path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method: "POST", body: JSON.stringify(body), headers }, base);
}

/** Carrier drives, and when it has arrived Scout looks. */
function driveThenLook(): Promise<{ id: string }> {
  const drive = { name: "Drive", instance_id: 0 };
  const look = { name: "Look", instance_id: 0 };
  const actions = [
    { ...drive, type: "sync", actor: "Carrier", parents: [], children: [look] },
    { ...look, type: "sync", actor: "Scout", parents: [drive], children: [] },
  ];
  const file = { graph_name: "drive_look", graph_entry: [drive], graph_exit: [look], actions };
  return post("/api/graphs", file, product.url);
}

test.beforeAll(async ({ browser }) => {
  carol.start(product.data, { "*": { after_s: 1.5 } });
  david.start(product.data, { "*": { after_s: 60, stop_s: 0.05 } });
  await product.start();
  const reach = ({ name, path }: StandIn) => ({ name, domain: DOMAIN, get_service: path });
  await post("/api/robots", { ...reach(carol), led: true });
  await post("/api/robots", reach(david));
  graph = (await driveThenLook()).id;
  ada = await product.person(browser, "Ada");
  mari = await product.person(browser, "Mari");
});

test.afterAll(async () => {
  for (const robot of [carol, david]) await robot.kill();
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await product.dispose();
});

test("a robot is led only after somebody has switched that on", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/robots`);
  const david = page.getByRole("article", { name: "David" });
  await expect(david.getByText("A stop can be proven")).toBeVisible({ timeout: 30_000 });
  await david.getByRole("button", { name: /^More about/ }).click();
  await page.getByRole("menuitem", { name: "Change …" }).click();
  await dialog(page).getByRole("switch", { name: "Runs that are led step by step" }).check();
  await dialog(page).getByRole("button", { name: "Save" }).click();
  await expect(david.getByText("Led step by step")).toBeVisible();
});

test("a robot that cannot show what it gives is refused, and the package for that is offered", async () => {
  const drive = { name: "Drive", instance_id: 0 };
  const look = { name: "Look", instance_id: 0 };
  const place = { place: { pvf_type: "string" } };
  const driving = { ...drive, type: "sync", actor: "Carrier", output_parameters: place };
  const looking = { ...look, type: "sync", actor: "Scout", input_parameters: place };
  const actions = [
    { ...driving, parents: [], children: [look] },
    { ...looking, parents: [drive], children: [] },
  ];
  const file = { graph_name: "drive_there", graph_entry: [drive], graph_exit: [look], actions };
  const { id } = await post<{ id: string }>("/api/graphs", file, product.url);
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await dialog(page).getByRole("combobox", { name: "Robot for Carrier" }).selectOption("Carol");
  await dialog(page).getByRole("combobox", { name: "Robot for Scout" }).selectOption("David");
  const looked = dialog(page).getByRole("list", { name: /Looked at on .*Carol/ });
  await expect(looked).toContainText("Drive_0 hands “place” to Look_0", { timeout: 15_000 });
  const loads = page.waitForEvent("download");
  await looked.getByRole("link", { name: "The package zz_keep_values" }).click();
  expect((await loads).suggestedFilename()).toBe("zz_keep_values.zip");
  await page.keyboard.press("Escape");
});

test("a led run passes from one robot to the other, and Stop ends it", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await expect(dialog(page).getByRole("radio", { name: /^Lead it/ })).toBeChecked();
  await dialog(page).getByRole("combobox", { name: "Robot for Carrier" }).selectOption("Carol");
  await expect(dialog(page).getByRole("button", { name: /Choose who plays Scout/ })).toBeDisabled();
  await dialog(page).getByRole("combobox", { name: "Robot for Scout" }).selectOption("David");
  await expect(dialog(page)).toContainText(/Carol.? and .?David.? may begin to move/);
  await dialog(page).getByRole("radio", { name: /wait/i }).check();
  const start = dialog(page).getByRole("button", { name: /^Start v1, step by step, on/ });
  await expect(start).toBeEnabled({ timeout: 15_000 });
  await holdEnter(page, start);
  await expect(moves(page)).toContainText("Carol Drive", { timeout: 10_000 });
  await expect(moves(page)).toContainText("David Look", { timeout: 10_000 });
  await expect(moves(page)).not.toContainText("not started here");
  const lane = page.getByRole("region", { name: "Run" }).locator('[data-lane="Look_0"]');
  const look = card(page, "Look");
  for (const said of [lane, look]) await expect(said).toContainText("running");
  david.freeze();
  for (const said of [lane, look]) await expect(said).toContainText("unknown", { timeout: 15_000 });
  const desktop = page.viewportSize() ?? { width: 1440, height: 900 };
  await page.setViewportSize({ width: 390, height: 844 });
  await expect(look).toBeVisible();
  const waits = page.getByRole("region", { name: "The run waits for a person" });
  await expect(waits).toContainText("David");
  await page.setViewportSize(desktop);
  david.thaw();
  for (const said of [lane, look]) await expect(said).toContainText("running", { timeout: 15_000 });
  await page.getByRole("button", { name: /^Stop/ }).first().click();
  await expect(moves(page)).toBeHidden({ timeout: 10_000 });
  const [run] = await product.ask<{ state: string; proof_at: string | null }[]>(
    "/api/runs",
    {},
    product.runnerUrl,
  );
  expect(run).toMatchObject({ state: "stopped", proof_at: expect.any(String) });
  await page.goto(`${product.url}/runs`);
  await expect(page.getByRole("row", { name: /drive_look/ })).toContainText("Carol, David");
});

const rest = (page: Page, robot: string) =>
  page.locator(`[data-robot-rest="${robot}"]`).filter({ visible: true }).first();
const lane = (page: Page, name: string) =>
  page.getByRole("region", { name: "Run" }).locator(`[data-lane="${name}_0"]`);

/** Starts the graph on screen: Carrier is Carol, Scout is David, and a lost robot is waited for. */
async function startLed(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await dialog(page).getByRole("combobox", { name: "Robot for Carrier" }).selectOption("Carol");
  await dialog(page).getByRole("combobox", { name: "Robot for Scout" }).selectOption("David");
  await dialog(page).getByRole("radio", { name: /wait/i }).check();
  const start = dialog(page).getByRole("button", { name: /^Start v1, step by step, on/ });
  await expect(start).toBeEnabled({ timeout: 15_000 });
  await holdEnter(page, start);
}

test("two people draw what Scout does when Carrier has arrived; one robot is lost, and stopped", async () => {
  const { page } = ada;
  await page.goto(product.url);
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  await mari.page.goto(page.url());
  await add(page, "Arrive");
  await enter(page, "Arrive");
  await setRobot(page, "Arrive", "Carrier");
  await add(mari.page, "Inspect");
  await setRobot(mari.page, "Inspect", "Scout");
  await connect(mari.page, "Arrive", "true", "Inspect");
  await fitView(page);
  await connect(page, "Inspect", "true", "exit");
  await saved(page);
  await startLed(page);
  await expect(lane(page, "Inspect")).toContainText("running", { timeout: 15_000 });
  await expect(lane(page, "Inspect")).toContainText(/began .* after Carrier: Arrive had ended/);
  await expect(rest(mari.page, "Carol")).toContainText("proven at rest");
  await expect(rest(mari.page, "David")).toContainText(/Inspect.* goes on/);

  david.freeze();
  await expect(rest(page, "David")).toContainText("silent since", { timeout: 15_000 });
  await page.getByRole("button", { name: /^Stop/ }).first().click();
  const notice = page.getByRole("alert").filter({ hasText: "STOP UNCONFIRMED" });
  await expect(notice.getByRole("listitem").filter({ hasText: "Carol" })).toContainText(
    "proven at rest",
  );
  await expect(notice.getByRole("listitem").filter({ hasText: "David" })).toContainText(
    /silent since .* the stop is repeated/,
  );
  for (const each of [page, mari.page]) {
    await expect(rest(each, "David")).toContainText("not known; the stop is repeated");
    await expect(rest(each, "Carol")).toContainText("proven at rest");
    await expect(each.getByText(/\d of \d/)).toHaveCount(0);
  }
  await page.setViewportSize({ width: 390, height: 844 });
  await expect(notice.getByRole("listitem")).toHaveCount(2);
  await page.setViewportSize({ width: 1440, height: 900 });
  david.thaw();
  for (const robot of ["Carol", "David"])
    await expect(rest(page, robot)).toContainText("proven at rest", { timeout: 15_000 });
  await expect(moves(page)).toBeHidden();
});

/** On a phone both questions of the run are there at once, and all in them is as high as a fingertip. */
async function onPhone(browser: Browser): Promise<void> {
  const options = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
  const kai = await product.person(browser, "Kai", options);
  await kai.page.goto(`${product.url}/graphs/${graph}`);
  for (const name of [/^Outcome of Look/, "The run waits for a person"]) {
    const asked = kai.page.getByRole("region", { name });
    await expect(asked.getByRole("button")).toBeInViewport();
    for (const each of await asked.locator("button, [type=text], label").all())
      expect((await each.boundingBox())?.height).toBeGreaterThanOrEqual(44);
  }
  expect(kai.failures).toEqual([]);
  await kai.context.close();
}

test("an outcome that nothing shows is given by word, and shown as said", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await startLed(page);
  await expect(lane(page, "Look")).toContainText("running", { timeout: 15_000 });
  await mari.page.goto(`${product.url}/robots`);
  const carried = mari.page.getByRole("article", { name: "David" });
  await expect(carried).toContainText(
    /In drive_look.*s run \d+ \(led\): further actions begin here/,
  );
  await david.kill();
  david.start(product.data, { "*": { after_s: 60, stop_s: 0.05 } });
  const question = page.getByRole("region", { name: /^Outcome of Look/ });
  await onPhone(browser);
  await question.getByText("True", { exact: true }).click();
  await question.getByRole("textbox").fill("The picture is on my desk");
  await holdEnter(page, question.getByRole("button", { name: /^Say that/ }));
  await expect(lane(page, "Look")).toContainText("true, said by Ada");
  await expect(rest(page, "David")).toContainText(/^David.*seen at rest .*, not proven/);
  const [run] = await product.ask<{ state: string; proof_at: string | null }[]>(
    "/api/runs?robot=David",
    {},
    product.runnerUrl,
  );
  expect(run).toMatchObject({ proof_at: null });
});
