/** A graph that asks for values when it is started: marked, asked, given, shown with the run, and said yes to. */
import { type Browser, expect, type Page, test } from "@playwright/test";
import { card, holdEnter, saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";

test.describe.configure({ mode: "serial" });

const product = new Product();
const david = new StandIn("David");
let ada: Person;
let graph: string;

const dialog = (page: Page) => page.getByRole("dialog");
const values = (page: Page) => dialog(page).getByRole("region", { name: "Values" });
const start = (page: Page, name: RegExp) => dialog(page).getByRole("button", { name });

interface Stored {
  id: string;
  number: number;
  state: string;
  values?: object;
}

const runs = () => product.ask<Stored[]>("/api/runs", {}, product.runnerUrl);

function post<T>(path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method: "POST", body: JSON.stringify(body), headers }, base);
}

/** Turn, whose valve is open, and whose torque stands in the graph. */
async function turn(): Promise<string> {
  const action = { name: "Turn", instance_id: 0, type: "sync" };
  const inputs = {
    valve: { pvf_type: "string", pvf_description: "which one", pvf_example: "valve_1" },
    torque: { pvf_type: "number", pvf_value: 5, pvf_unit: "Nm" },
  };
  const end = [{ name: "Turn", instance_id: 0 }];
  const actions = [{ ...action, input_parameters: inputs, parents: [], children: [] }];
  const file = { graph_name: "turn", graph_entry: end, graph_exit: end, actions };
  return (await post<{ id: string }>("/api/graphs", file, product.url)).id;
}

/** A person who came by a link for them alone. */
async function personally(browser: Browser, name: string): Promise<Person> {
  const member = { name, role: "operator" };
  const made = await post<{ links: { path: string }[] }>("/api/members", member, product.url);
  const context = await browser.newContext();
  const page = await context.newPage();
  const failures: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  await page.goto(`${product.url}${made.links[0]?.path}`);
  await page.getByRole("button", { name: /^Come in as/ }).click();
  await page.getByRole("button", { name: /^You are / }).waitFor();
  return { context, page, failures };
}

test.beforeAll(async ({ browser }) => {
  await product.start();
  graph = await turn();
  ada = await personally(browser, "Ada");
});

test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await ada.context.close();
  await product.dispose();
});

test("an author marks an input, with the most that can be given, and undo takes it back", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await card(page, "Turn").click();
  await expect(page.getByText("still to fill in, here or at each start").last()).toBeVisible();
  await page.getByRole("button", { name: "What the parameter torque is" }).click();
  const mark = page.getByRole("switch", { name: "Ask at the start" });
  await mark.check({ force: true });
  await page.getByLabel("At most").fill("60");
  await page.getByLabel("At most").press("Enter");
  await expect(page.getByLabel("asked at the start")).toBeVisible();
  await page.getByRole("button", { name: "Close", exact: true }).click();
  await saved(page);
});

test("a dry-run asks as a start does, and is played with what is given", async () => {
  const { page } = ada;
  await page.getByRole("button", { name: "Dry-run", exact: true }).click();
  const asked = page.getByRole("region", { name: "Values" });
  const bar = page.getByRole("region", { name: "Dry-run" });
  const valve = asked.getByRole("textbox", { name: "valve of Turn" });
  const moment = bar.getByRole("slider", { name: "Moment" });
  await expect(
    bar.getByRole("button", { name: /^Run in the simulator: Give valve of Turn/ }),
  ).toBeDisabled();
  await asked.getByRole("textbox", { name: "torque of Turn" }).fill("61");
  await expect(asked).toContainText("60 at most.");
  await asked.getByRole("button", { name: /in the graph/ }).click();
  await valve.fill("valve_8");
  await expect(moment).toHaveAttribute("aria-valuetext", /Turn runs/);
  await bar.getByRole("button", { name: "2 values" }).click();
  await expect(asked).toBeHidden();
  await expect(bar.getByRole("button", { name: /^Run in the simulator: v1/ })).toBeEnabled();
  await bar.getByRole("button", { name: "Close the dry-run" }).click();
});

test("the simulator asks too: nothing starts without what is open, and nothing beyond its bounds", async () => {
  const { page } = ada;
  await page.getByRole("button", { name: /^Run v1 in the simulator …/ }).click();
  await expect(start(page, /Give valve of Turn/)).toBeDisabled();
  const valve = values(page).getByRole("textbox", { name: "valve of Turn" });
  const torque = values(page).getByRole("textbox", { name: "torque of Turn" });
  await expect(torque).toHaveValue("5");
  await values(page)
    .getByRole("button", { name: /valve_1/ })
    .click();
  await expect(valve).toHaveValue("valve_1");
  await torque.fill("61");
  await expect(values(page)).toContainText("60 at most.");
  await expect(start(page, /Correct torque of Turn/)).toBeDisabled();
  await torque.fill("6.5");
  await valve.fill("valve_8");
  const held = start(page, /^Run v1 in the simulator/);
  await expect(held).toBeEnabled({ timeout: 15_000 });
  await expect(dialog(page).getByText('Turn valve = "valve_8"')).toBeVisible();
  await holdEnter(page, held);
  await expect(dialog(page)).toBeHidden();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 20_000 }).toBe("finished");
  expect((await runs())[0]?.values).toEqual({ Turn_0: { torque: 6.5, valve: "valve_8" } });
});

test("the next start begins with these values, and what is changed is looked at anew, on a phone too", async () => {
  const { page } = ada;
  await page.setViewportSize({ width: 390, height: 844 });
  await page.getByRole("button", { name: /^Run v1 in the simulator …/ }).click();
  const valve = values(page).getByRole("textbox", { name: "valve of Turn" });
  await expect(valve).toHaveValue("valve_8");
  await expect(values(page).getByRole("textbox", { name: "torque of Turn" })).toHaveValue("6.5");
  const held = start(page, /^Run v1 in the simulator/);
  await expect(held).toBeEnabled({ timeout: 15_000 });
  await valve.fill("\u202eeno");
  await expect(values(page)).toContainText("no control characters");
  await expect(held).toBeHidden();
  await valve.fill("ברז");
  await expect(held).toBeEnabled({ timeout: 15_000 });
  await values(page)
    .getByRole("button", { name: /in the graph/ })
    .click();
  await expect(held).toBeEnabled({ timeout: 15_000 });
  await holdEnter(page, held);
  await expect(dialog(page)).toBeHidden();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 20_000 }).toBe("finished");
  expect((await runs())[0]?.values).toEqual({ Turn_0: { valve: "ברז" } });
  await page.setViewportSize({ width: 1440, height: 900 });
});

test("the list, the run, and the comparison of two say what was set; run again begins with it", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs`);
  await expect(page.getByRole("row", { name: /Run 1 / })).toContainText('Turn valve = "valve_8"');
  const [second, first] = await runs();
  await page.goto(`${product.url}/runs/compare?a=${first?.id}&b=${second?.id}`);
  const differ = page.getByRole("list", { name: "Different values" });
  await expect(differ).toContainText("6.5 in run 1, as in the graph in run 2");
  await expect(page.getByText("Both ran exactly the same graph")).toBeHidden();
  await expect(page.getByText("Every visit ended the same, with 2 different")).toBeVisible();
  await expect(page.getByRole("tab", { name: "Differences 2" })).toBeVisible();
  await page.goto(`${product.url}/runs/${first?.id}`);
  const started = page.getByRole("list", { name: "Started with" });
  await expect(started).toContainText('Turn valve = "valve_8"');
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Show the lanes" }).click();
  await expect(started).toContainText('Turn valve = "ברז"');
  await page.goto(`${product.url}/runs/${first?.id}`);
  await page.getByRole("tab", { name: "Facts" }).click();
  await expect(page.getByText('Turn valve = "valve_8"').first()).toBeAttached();
  await page.getByRole("button", { name: "Run again" }).click();
  await page.getByRole("menuitem", { name: "v1 again …" }).click();
  await expect(values(page).getByRole("textbox", { name: "valve of Turn" })).toHaveValue("valve_8");
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "Run again" }).click();
  await page.getByRole("menuitem", { name: "As it went", exact: true }).click();
  await expect.poll(async () => (await runs())[0]?.number).toBe(3);
  expect((await runs())[0]?.values).toEqual({ Turn_0: { torque: 6.5, valve: "valve_8" } });
});

test("a second person takes over the values for which one asks, and says yes to exactly these", async ({
  browser,
}) => {
  test.skip(NO_ROS !== "", NO_ROS);
  test.setTimeout(120_000);
  david.start(product.data, { "*": { after_s: 1 } });
  const robot = { name: david.name, domain: DOMAIN, get_service: david.path };
  await post("/api/robots", { ...robot, profile: { second_person: true } });
  const ben = await personally(browser, "Ben");
  const look = (page: Page) => page.getByRole("list", { name: "Looked at on David" });
  const open = async (page: Page) => {
    await page.goto(`${product.url}/graphs/${graph}`);
    await saved(page);
    await page.getByRole("button", { name: "Choose where to start" }).click();
    await page.getByRole("checkbox", { name: /^David/ }).check();
  };
  await open(ada.page);
  const valve = (page: Page) => values(page).getByRole("textbox", { name: "valve of Turn" });
  await valve(ada.page).fill("valve_9");
  await expect(look(ada.page)).toContainText("exactly this start", { timeout: 30_000 });
  await dialog(ada.page).getByRole("button", { name: "Ask others for their yes" }).click();
  await expect(dialog(ada.page)).toContainText(
    "They see it where they start the graph, or in the queue.",
  );
  await open(ben.page);
  await values(ben.page).getByRole("button", { name: "Take these values" }).click();
  await expect(valve(ben.page)).toHaveValue("valve_9");
  await expect(valve(ben.page)).toHaveAttribute("readonly", "");
  await expect(dialog(ben.page)).toContainText("Exactly the start for which Ada asks");
  await dialog(ben.page)
    .getByRole("button", { name: /^Say yes to v1/ })
    .click();
  await expect(look(ada.page)).toContainText("Ben said yes to exactly this start", {
    timeout: 20_000,
  });
  const held = start(ada.page, /^Start v1 on David/);
  await expect(held).toBeEnabled();
  await holdEnter(ada.page, held);
  await expect(dialog(ada.page)).toBeHidden();
  await expect.poll(async () => (await runs())[0]?.state, { timeout: 20_000 }).toBe("finished");
  expect((await runs())[0]?.values).toEqual({ Turn_0: { torque: 6.5, valve: "valve_9" } });
  expect(ben.failures).toEqual([]);
  await ben.context.close();
  await david.kill();
});

test("a start is repeated over a grid of values; on its page a person starts, closes and opens again", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await dialog(page)
    .getByRole("radio", { name: /^Simulator/ })
    .check();
  const choice = dialog(page).getByRole("region", { name: "Repeat" });
  await choice.getByRole("checkbox", { name: "Repeat it" }).check();
  const grid = choice.getByRole("textbox", { name: "Values of torque of Turn" });
  await values(page).getByRole("textbox", { name: "valve of Turn" }).fill("valve_7");
  await grid.fill("1\n61");
  await expect(choice).toContainText("60 at most.");
  await grid.fill("1\n2.5");
  await choice.getByRole("textbox", { name: "Rounds" }).fill("2");
  await expect(choice).toContainText("4 runs, one after the other, in the simulator.");
  const opens = start(page, /^Repeat v1 in the simulator: 4 runs/);
  await expect(opens).toBeEnabled({ timeout: 15_000 });
  await opens.click();
  const state = page.getByRole("status").filter({ hasText: "finished" });
  await expect(state).toContainText("Complete", { timeout: 30_000 });
  const rows = page.getByRole("region", { name: "Runs of the repeat" }).getByRole("row");
  await expect(rows).toHaveCount(5);
  await expect(rows.nth(2)).toContainText("Turn torque = 2.5");
  await expect(page.getByRole("link", { name: "CSV" })).toBeVisible();

  const [version] = await product.ask<{ id: string }[]>(`/api/graphs/${graph}/versions`);
  const whole = await product.ask<{ digest: string; umrf: object }>(`/api/versions/${version?.id}`);
  const order = { version: version?.id, digest: whole.digest, umrf: whole.umrf, graph };
  const by = { engine: "simulator", request_id: "twice", values: { Turn_0: { valve: "v" } } };
  const opened = await post<{ id: string }>("/api/repeats", {
    start: { ...order, ...by },
    times: 2,
  });
  await page.goto(`${product.url}/runs/repeats/${opened.id}`);
  await expect(state).toContainText("Waits for a person: run 1 of 2");
  await holdEnter(page, page.getByRole("button", { name: /^Start run 1 of 2/ }));
  await expect(state).toContainText("run 2 of 2", { timeout: 20_000 });
  await page.getByRole("button", { name: "Stop repeating" }).click();
  await expect(state).toContainText("stopped repeating");
  await page.getByRole("button", { name: "Look again, and open it" }).click();
  await holdEnter(page, page.getByRole("button", { name: /^Reset done: start 2 of 2/ }));
  await expect(state).toContainText("Complete", { timeout: 20_000 });
  await page.goto(`${product.url}/runs/repeats`);
  await expect(page.getByRole("link", { name: /^turn, 4 runs/ })).toBeVisible();
});
