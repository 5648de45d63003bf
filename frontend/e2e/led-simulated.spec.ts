/** A led run in the simulator: it waits at a breakpoint, goes step by step, and says why on the phone too. */

import { expect, type Page, test } from "@playwright/test";
import { card, holdEnter, saved } from "./canvas";
import { type Person, Product } from "./product";
import { choose } from "./valves";

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

const dialog = (page: Page) => page.getByRole("dialog");
const waits = (page: Page) =>
  page.getByRole("region", { name: "The run waits for a person" }).filter({ visible: true });
const runs = () => product.ask<{ id: string; state: string }[]>("/api/runs", {}, product.runnerUrl);

/** Actions one after the other. */
async function line(graph_name: string, count: number): Promise<string> {
  const all = ["Drive", "Grip", "Lift", "Look", "Drop"].slice(0, count);
  const names = all.map((name) => ({ name, instance_id: 0 }));
  const actions = names.map((each, i) => ({
    ...{ ...each, type: "sync" },
    ...{ parents: names.slice(Math.max(0, i - 1), i), children: names.slice(i + 1, i + 2) },
  }));
  const ends = { graph_entry: names.slice(0, 1), graph_exit: names.slice(-1) };
  const body = JSON.stringify({ graph_name, ...ends, actions });
  const headers = { "content-type": "application/json" };
  const made = await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers });
  return made.id;
}

test("a simulated run waits at a breakpoint, goes on to an action, and Stop ends it at the gate", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${await line("line", 3)}`);
  await saved(page);
  await card(page, "Grip").click({ position: { x: 40, y: 24 } });
  await page.keyboard.press("F9");
  await saved(page);
  const led = dialog(page).getByRole("radio", { name: /^Lead it/ });
  const start = dialog(page).getByRole("button", { name: /^Run v\d+, step by step, in/ });

  // One press would hand the graph over whole, and nothing would wait.
  await page.getByRole("button", { name: "Run v1 in the simulator …" }).click();
  await expect(led).toBeChecked();
  await expect(dialog(page)).toContainText("Only the simulator plays: nothing moves.");
  await expect(dialog(page)).not.toContainText("When a robot does not answer");
  await expect(dialog(page)).toContainText("The run waits at 1 breakpoint.", { timeout: 15_000 });
  await expect(start).toBeEnabled({ timeout: 15_000 });
  await holdEnter(page, start);

  await expect(waits(page)).toContainText("Breakpoint before Grip", { timeout: 15_000 });
  const step = (name: string) =>
    waits(page).getByRole("button", { name: `Let only ${name} on the simulator begin` });
  await expect(step("Grip")).toBeVisible();
  await expect(card(page, "Grip")).not.toContainText("running");
  const desktop = page.viewportSize() ?? { width: 1440, height: 900 };
  await page.setViewportSize({ width: 390, height: 844 });
  await expect(waits(page)).toContainText("Breakpoint before Grip");
  await page.setViewportSize(desktop);

  const far = waits(page).getByRole("combobox", { name: "How far it goes on" });
  await expect(far.getByRole("option")).toContainText(["to its end", "until Drive", "until Lift"]);
  await far.selectOption("Lift_0");
  await holdEnter(page, waits(page).getByRole("button", { name: /until Lift is about to begin$/ }));
  await expect(waits(page)).toContainText("It went on until Lift,", { timeout: 15_000 });
  await expect(step("Lift")).toBeVisible();
  await page.getByRole("button", { name: /^Stop/ }).first().click();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 15_000 }).toBe("stopped");
  await expect(waits(page)).toBeHidden();
});

const text = (value: string) => ({ pvf_type: "string", pvf_value: value });

/** Opens a new graph of ready-made actions, one after the other, and starts it in the simulator. */
async function asks(page: Page, asking: readonly (readonly [string, object])[]): Promise<void> {
  const names = asking.map(([name]) => ({ name, instance_id: 0 }));
  const actions = asking.map(([name, input_parameters], i) => ({
    ...{ name, instance_id: 0, type: "sync", input_parameters },
    ...{ parents: names.slice(Math.max(0, i - 1), i), children: names.slice(i + 1, i + 2) },
  }));
  const ends = { graph_entry: names.slice(0, 1), graph_exit: names.slice(-1) };
  const body = JSON.stringify({ graph_name: "asking", ...ends, actions });
  const headers = { "content-type": "application/json" };
  const made = await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers });
  await page.goto(`${product.url}/graphs/${made.id}`);
  await saved(page);
  await page.getByRole("button", { name: /^Run v\d+ in the simulator …/ }).click();
  await dialog(page)
    .getByRole("button", { name: /^Run v\d+, step by step, in/ })
    .click();
}

test("a phone answers with a photo of 8 MB, and not with a larger one", async () => {
  const { page } = ada;
  await asks(page, [["AaAskPhoto", { question: text("How does the gripper look?") }]]);
  await page.setViewportSize({ width: 390, height: 844 });
  await page.getByRole("link", { name: /asks: .*How does the gripper look/ }).click();
  const asked = page.getByRole("region", { name: /^Question of/ });
  const take = asked.getByRole("button", { name: "Take or choose a photo" });
  const most = 8 * 1024 * 1024;
  const picture = (size: number) => {
    const buffer = Buffer.alloc(size, 7);
    Buffer.from([0xff, 0xd8, 0xff, 0xe0]).copy(buffer);
    return { name: "gripper.jpg", mimeType: "image/jpeg", buffer };
  };
  const choosing = async (size: number) => {
    const chooser = page.waitForEvent("filechooser");
    await take.click();
    await (await chooser).setFiles(picture(size));
  };
  await choosing(most + 1);
  const refusal = page.getByRole("alert").filter({ hasText: /large|MB/i });
  await expect(refusal).toBeVisible({ timeout: 15_000 });
  expect((await runs())[0]?.state).toBe("running");
  await choosing(most);
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 30_000 }).toBe("finished");
  await page.setViewportSize({ width: 1440, height: 900 });
  const link = page.getByRole("list", { name: "Answered" }).getByRole("link", { name: "photo" });
  const photo = await page.request.get((await link.getAttribute("href")) ?? "");
  expect((await photo.body()).length).toBe(most);
});

test("a run asks people, on every page, and their first answer is its outcome", async () => {
  const { page } = ada;
  const choices = { pvf_type: "strings", pvf_value: ["left", "right"] };
  await asks(page, [
    ["AaConfirm", { question: text("Is the door open?") }],
    ["AaChoose", { question: text("Which shelf?"), choices }],
  ]);
  const asked = page.getByRole("region", { name: /^Question of/ });
  await expect(asked).toContainText("Is the door open?", { timeout: 15_000 });

  // Whoever is asked sees it on the phone, on another page, and answers there.
  await page.setViewportSize({ width: 360, height: 740 });
  const chip = page.getByRole("link", { name: /asks: .*Is the door open/ });
  const isRead = async () => {
    await expect(chip).toBeInViewport({ ratio: 1 });
    expect((await chip.boundingBox())?.width).toBeGreaterThan(340);
  };
  await isRead();
  await page.goto(product.url);
  await isRead();
  await expect(page.getByRole("link", { name: "Runs", exact: true })).toBeInViewport();
  await chip.click();
  await expect(chip).toBeHidden();
  await asked.getByRole("button", { name: "Yes" }).click();
  await expect(asked).toContainText("Which shelf?");
  await asked.getByRole("button", { name: "right" }).click();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 15_000 }).toBe("finished");
  await page.setViewportSize({ width: 1440, height: 900 });
  const answers = page.getByRole("list", { name: "Answered" });
  await expect(answers).toContainText(/Confirm: yes, by .?Ada/);
  await expect(answers).toContainText(/Choose: right, by .?Ada/);
});

/** Leads a graph in the simulator until it waits at a breakpoint before its action *Grip*. */
async function waitsAtGrip(page: Page, graph: string): Promise<void> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await card(page, "Grip").click({ position: { x: 40, y: 24 } });
  await page.keyboard.press("F9");
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  const start = dialog(page).getByRole("button", { name: /^Run v\d+, step by step, in/ });
  await expect(start).toBeEnabled({ timeout: 15_000 });
  await holdEnter(page, start);
  await expect(waits(page)).toContainText("Breakpoint before Grip", { timeout: 15_000 });
}

test("on the canvas of a run people let it wait at an action and an arrow, and go on until one", async () => {
  const { page } = ada;
  await waitsAtGrip(page, await line("belt", 5));
  const at = (place: string) =>
    page.getByRole("region", { name: new RegExp(`^${place} in run`) }).filter({ visible: true });

  // In the editor the run has breakpoints of its own beside those of the graph.
  await choose(page, "Look");
  await at("Look")
    .getByRole("button", { name: /^Let run \d+ wait at Look$/ })
    .click();
  await expect(at("Look")).toContainText("This run waits before this.");
  await expect(card(page, "Look").locator("[data-breakpoint]")).toBeVisible();

  const [run] = await runs();
  await page.goto(`${product.url}/runs/${run?.id}`);
  await expect(card(page, "Look").locator("[data-breakpoint]")).toBeVisible();
  await card(page, "Lift").focus();
  await page.keyboard.press("Enter");
  const far = at("Lift").getByRole("button", { name: /go on until Lift is about to begin$/ });
  await expect(far).toBeEnabled();
  await page.locator('[aria-label^="Arrow from Lift 0, when true"]').focus();
  await page.keyboard.press("Enter");
  await at("Lift → Look")
    .getByRole("button", { name: /^Let run/ })
    .click();
  await expect(page.locator(".react-flow__edgelabel-renderer [data-breakpoint]")).toBeVisible();

  await card(page, "Look").click({ position: { x: 40, y: 24 } });
  const removed = at("Look").getByRole("button", { name: /no longer wait at Look$/ });
  await holdEnter(page, removed);
  await expect(removed).toBeHidden();
  await card(page, "Lift").click({ position: { x: 40, y: 24 } });
  await holdEnter(page, far);
  await expect(waits(page)).toContainText("It went on until Lift,", { timeout: 15_000 });
  await holdEnter(page, waits(page).getByRole("button", { name: /^Let run \d+ go on$/ }));
  await expect(waits(page)).toContainText("towards Look", { timeout: 15_000 });
  await page.getByRole("button", { name: /^Stop/ }).first().click();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 15_000 }).toBe("stopped");
  await expect(at("Lift")).toBeHidden();
});

test("a step goes into a sub-graph that is opened, and over it", async () => {
  const { page } = ada;
  const inner = ["Reach", "Close"].map((name) => ({ name, instance_id: 0 }));
  const two = inner.map((each, i) => ({
    ...{ ...each, type: "sync" },
    ...{ parents: inner.slice(0, i), children: inner.slice(i + 1) },
  }));
  const headers = { "content-type": "application/json" };
  const ends = { graph_entry: inner.slice(0, 1), graph_exit: inner.slice(1) };
  const body = JSON.stringify({ graph_name: "Grip", ...ends, actions: two });
  const inside = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    ...{ body, headers },
  });
  /** Sets a breakpoint at a card, or takes it away. */
  const toggle = async (graph: string, name: string) => {
    await page.goto(`${product.url}/graphs/${graph}`);
    await saved(page);
    await card(page, name).click({ position: { x: 40, y: 24 } });
    await page.keyboard.press("F9");
    await saved(page);
  };
  const openLevels = async () => {
    await page.getByRole("button", { name: "Choose where to start" }).click();
    await dialog(page)
      .getByRole("radio", { name: /^Opened/ })
      .click();
  };
  const nested = await line("nested", 3);
  await toggle(inside.id, "Close");
  await toggle(nested, "Grip");
  await openLevels();
  const words = "The run waits at 2 breakpoints, 1 of them inside of Grip.";
  await expect(dialog(page)).toContainText(words, { timeout: 15_000 });
  await dialog(page).getByText(words).scrollIntoViewIfNeeded();
  await page.screenshot({ path: "test-results/inside-1440.png" });
  await page.setViewportSize({ width: 360, height: 780 });
  await dialog(page).getByText(words).scrollIntoViewIfNeeded();
  await page.screenshot({ path: "test-results/inside-360.png" });
  await page.setViewportSize({ width: 1440, height: 900 });
  const start = dialog(page).getByRole("button", { name: /^Run v\d+, step by step, in/ });
  await expect(start).toBeEnabled({ timeout: 15_000 });
  await page.screenshot({ path: "test-results/opened-1440.png" });
  await holdEnter(page, start);

  const step = (name: string) =>
    waits(page).getByRole("button", { name: `Let only ${name} on the simulator begin` });
  await expect(waits(page)).toContainText("Breakpoint before Grip › Reach", { timeout: 15_000 });
  await holdEnter(page, waits(page).getByRole("button", { name: /^Let run \d+ go on$/ }));
  await expect(waits(page)).toContainText("Breakpoint before Grip › Close", { timeout: 15_000 });
  await expect(step("Grip › Close")).toBeVisible();
  await expect(card(page, "Grip")).toContainText("1 of 2 inside ended");
  await page.screenshot({ path: "test-results/over-1440.png" });
  await holdEnter(page, waits(page).getByRole("button", { name: /^Let all inside of .?Grip/ }));
  await expect(waits(page)).toContainText("It went over Grip: Lift waits to begin", {
    timeout: 15_000,
  });
  await expect(card(page, "Grip")).toContainText("2 of 2 inside ended");
  await page.getByRole("button", { name: /^Stop/ }).first().click();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 15_000 }).toBe("stopped");

  const [stopped] = await runs();
  await page.goto(`${product.url}/runs/${stopped?.id}`);
  const again = async (name: string) => {
    await page.getByRole("button", { name: "Run again" }).click();
    await page.getByRole("menuitem", { name, exact: true }).click();
  };
  await again("Continue where it ended …");
  await expect(dialog(page)).toContainText(words, { timeout: 15_000 });
  await holdEnter(page, start);
  const soon = { timeout: 20_000 };
  await expect.poll(async () => (await runs())[0]?.state, soon).toBe("finished");
  const [continued] = await runs();
  expect(continued?.id).not.toBe(stopped?.id);
  await page.goto(`${product.url}/runs/${stopped?.id}`);
  await again("As it went");
  await expect.poll(async () => (await runs())[0]?.id, soon).not.toBe(continued?.id);
  await expect.poll(async () => (await runs())[0]?.state, soon).toBe("finished");
  const [repeated] = await runs();
  const { actions } = await product.ask<{ actions: object }>(
    ...([`/api/runs/${repeated?.id}`, {}, product.runnerUrl] as const),
  );
  expect(Object.keys(actions).sort()).toEqual(["Close_0", "Drive_0", "Lift_0", "Reach_0"]);

  await page.goto(`${product.url}/runs/${continued?.id}`);
  await again("As it went, with the newest version");
  await expect.poll(async () => (await runs())[0]?.id, soon).not.toBe(repeated?.id);
  await expect.poll(async () => (await runs())[0]?.state, soon).toBe("finished");
  const [newest] = await runs();
  const led = await product.ask<{ engine: string; actions: Record<string, { levels?: string[] }> }>(
    ...([`/api/runs/${newest?.id}`, {}, product.runnerUrl] as const),
  );
  const opened = Object.entries(led.actions).filter(([, { levels }]) => levels !== undefined);
  expect([led.engine, opened.map(([name]) => name).sort()]).toEqual([
    "conducted",
    ["Close_0", "Reach_0"],
  ]);
});

test("a part of a graph begins by no double click and no drag, but in the dialog that looks first", async () => {
  const { page } = ada;
  const before = await runs();
  await page.goto(`${product.url}/graphs/${await line("parts", 3)}`);
  await saved(page);
  const at = { position: { x: 40, y: 24 } };
  const start = dialog(page).getByRole("button", { name: /^Run v\d+ in the simulator$/ });
  await page.keyboard.press("Control+a");
  // A graph of another test is named Grip: its card opens that.
  await card(page, "Lift").dblclick(at);
  await card(page, "Lift").dragTo(card(page, "Drive"), { sourcePosition: at.position });
  for (const name of ["Run from here …", "Run only this …"]) {
    const choose = async () => {
      await page.keyboard.press("Escape");
      await card(page, "Drive").click({ button: "right", ...at });
      return page.getByRole("menuitem", { name });
    };
    await (await choose()).dragTo(card(page, "Lift"));
    await expect(start).toBeHidden();
    await (await choose()).dblclick();
    await (await choose()).click();
    await expect(start).toBeEnabled({ timeout: 15_000 });
    await start.dragTo(dialog(page).getByRole("heading").first());
    await page.keyboard.press("Escape");
    await expect(dialog(page)).toBeHidden();
  }
  expect(await runs()).toEqual(before);
});

test("a dry-run begins at an action, or plays nothing else", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${await line("middle", 3)}`);
  await saved(page);
  const bar = page.getByRole("region", { name: "Dry-run" });
  await card(page, "Grip").click({ button: "right", position: { x: 40, y: 24 } });
  await page.getByRole("menuitem", { name: "Dry-run from here" }).click();
  await expect(bar).toContainText(/from .?Grip.?; what is skipped counts as ended/);
  await expect(card(page, "Grip")).toContainText("running");
  await expect(card(page, "Drive")).not.toContainText("running");
  await page.screenshot({ path: "test-results/dry-run-from-1440.png" });
});

test("the canvas of a run has a menu by keys, mouse and finger: wait, go on until here, run from here", async () => {
  const { page } = ada;
  await waitsAtGrip(page, await line("menu", 4));
  const [run] = await runs();
  await page.goto(`${product.url}/runs/${run?.id}`);
  const menu = page.getByRole("dialog", { name: "What can be done here" });

  await card(page, "Look").focus();
  await page.keyboard.press("Shift+F10");
  await menu.getByRole("button", { name: /^Let run \d+ wait at Look$/ }).click();
  await expect(card(page, "Look").locator("[data-breakpoint]")).toBeVisible();
  await page.screenshot({ path: "test-results/run-menu-1440.png" });
  await page.keyboard.press("Escape");
  await expect(menu).toBeHidden();
  await card(page, "Lift").click({ button: "right", position: { x: 40, y: 24 } });
  await expect(menu.getByRole("button", { name: /go on until Lift/ })).toBeEnabled();
  await page.keyboard.press("Escape");

  await page.setViewportSize({ width: 360, height: 740 });
  await page.reload(); // the view fits the graph once
  await expect(card(page, "Lift")).toBeInViewport();
  const box = await card(page, "Lift").boundingBox();
  const at = { clientX: (box?.x ?? 0) + 20, clientY: (box?.y ?? 0) + 15 };
  const finger = { pointerId: 9, pointerType: "touch", bubbles: true, ...at };
  await card(page, "Lift").dispatchEvent("pointerdown", finger);
  await expect(menu).toBeVisible();
  await card(page, "Lift").dispatchEvent("pointerup", finger);
  await page.screenshot({ path: "test-results/run-menu-360.png" });
  await holdEnter(page, menu.getByRole("button", { name: /go on until Lift/ }));
  await expect(waits(page)).toContainText("It went on until Lift,", { timeout: 15_000 });
  await page.keyboard.press("Escape");
  await page.setViewportSize({ width: 1440, height: 900 });

  await page.getByRole("button", { name: /^Stop/ }).first().click();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 15_000 }).toBe("stopped");
  await card(page, "Look").focus();
  await page.keyboard.press("Shift+F10");
  await menu.getByRole("button", { name: /^Run from .?Look.? …$/ }).click();
  await expect(dialog(page)).toContainText(/Run from .?Look/);
});
