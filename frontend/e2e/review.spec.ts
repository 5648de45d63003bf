/** Looking back: find a run, replay it, compare it with another, run it again with a fault. */

import { expect, type Page, test } from "@playwright/test";
import { atRest, boxOf, card, frames } from "./canvas";
import { type Person, Product } from "./product";

interface Run {
  id: string;
  number: number;
  state: string;
  result: string | null;
}

const product = new Product();
let ada: Person;
let graph: string;
let good: Run;
let bad: Run;

const QUICK = { after_s: 0.25 };
const JAMMED = { after_s: 0.25, result: "on_error", message: "gripper jammed" };

async function version(of: string): Promise<{ id: string; digest: string; umrf: string }> {
  const made = await product.ask<{ id: string; digest: string }>(`/api/graphs/${of}/versions`, {
    method: "POST",
    body: "{}",
    headers: { "content-type": "application/json" },
  });
  const umrf = JSON.stringify(
    (await product.ask<{ umrf: unknown }>(`/api/versions/${made.id}`)).umrf,
  );
  return { ...made, umrf };
}

/** Runs the graph's newest version with actions that do as they are told, to its end. */
async function ran(behaviours: Record<string, unknown[]>, of = graph): Promise<Run> {
  const { id, digest, umrf } = await version(of);
  const head = {
    version: id,
    digest,
    graph: of,
    engine: "simulator",
    request_id: `e2e-${Math.random()}`,
  };
  const body = JSON.stringify({ ...head, script: { behaviours }, umrf });
  const run = await product.ask<Run>("/api/runs", { method: "POST", body }, product.runnerUrl);
  const now = () => product.ask<Run>(`/api/runs/${run.id}`, {}, product.runnerUrl);
  await expect.poll(async () => (await now()).state, { timeout: 20_000 }).toMatch(/finished|error/);
  return now();
}

type Box = { x: number; y: number; width: number; height: number };

function overlap(a: Box, b: Box): boolean {
  const inside = a.x < b.x + b.width && b.x < a.x + a.width;
  return inside && a.y < b.y + b.height && b.y < a.y + a.height;
}

/** The words on the cards, in their order on the canvas. */
function words(page: Page): Promise<string[]> {
  return page.locator(".react-flow__node-action span[data-tone]").allTextContents();
}

test.beforeAll(async ({ browser }) => {
  await product.start();
  graph = await product.chain(3);
  good = await ran({ "*": [QUICK] });
  bad = await ran({ Wait_1: [JAMMED], "*": [QUICK] });
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

test("a replay shows each moment as it was known then, by mouse and by keyboard", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${good.id}`);
  await expect(card(page, "Wait").first().getByText("true")).toBeVisible();
  await page.getByRole("button", { name: "To the start" }).click();
  await expect(page.getByText("as it was then")).toBeVisible();
  await page.keyboard.press("ArrowRight"); // from the request on, change by change
  const next = page.getByRole("button", { name: "The next change" });
  for (let i = 0; i < 12 && !(await words(page)).some((word) => word.includes("running")); i += 1) {
    await next.click();
  }
  expect((await words(page)).filter((word) => word.includes("running"))).toHaveLength(1);
  expect((await words(page)).some((word) => word.includes("true"))).toBe(false);
  await expect.poll(() => new URL(page.url()).searchParams.get("t")).not.toBeNull();
  const shared = page.url();
  await page.getByLabel("Speed of the replay").selectOption("16");
  await page.getByText("as it was then").click(); // keys belong to the button that was pressed last
  await page.keyboard.press("Space");
  await expect(page.getByText("as it was then")).toBeHidden();
  expect((await words(page)).filter((word) => word.includes("true"))).toHaveLength(3);
  await page.goto(shared); // a link carries the moment
  await expect(page.getByText("as it was then")).toBeVisible();
  await expect
    .poll(async () => (await words(page)).filter((w) => w.includes("running")))
    .toHaveLength(1);
});

test("what the page showed live is what the replay shows of that moment", async () => {
  const { page } = ada;
  const { id, digest, umrf } = await version(graph);
  const script = { behaviours: { "*": [{ after_s: 1.8 }] } };
  const head = { version: id, digest, graph, engine: "simulator", request_id: "e2e-live", script };
  const body = JSON.stringify({ ...head, umrf });
  const { id: run } = await product.ask<Run>(
    "/api/runs",
    { method: "POST", body },
    product.runnerUrl,
  );
  await page.goto(`${product.url}/runs/${run}`);
  const states = async () => (await words(page)).map((word) => word.replace(/\W*[\d≤].*$/, ""));
  const live: { at: number; states: string[] }[] = [];
  await expect
    .poll(
      async () => {
        const [before, from] = [await states(), Date.now()];
        await frames(page, 12); // in which the page shows what was on its way
        if (String(await states()) !== String(before)) return false;
        const at = (from + Date.now()) / 2;
        const known = live.map((each) => String(each.states));
        if (before.length === 3 && !known.includes(String(before))) {
          live.push({ at, states: before });
        }
        return before.length === 3 && before.every((word) => word.includes("true"));
      },
      { timeout: 20_000, intervals: [50] },
    )
    .toBe(true);
  expect(live.length).toBeGreaterThanOrEqual(3); // two that ran, and the end
  const { started_at } = await product.ask<{ started_at: string }>(
    `/api/runs/${run}`,
    {},
    product.runnerUrl,
  );
  for (const { at, states: then } of live.slice(0, -1)) {
    await page.goto(`${product.url}/runs/${run}?t=${at - Date.parse(started_at)}`);
    await expect(page.getByText("as it was then")).toBeVisible();
    await expect.poll(states).toEqual(then);
  }
});

test("a run is found by what was said in it, pinned, labelled and found by that", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${bad.id}`);
  await page.getByRole("tab", { name: "Facts" }).click();
  await page.getByRole("button", { name: "Pin this run" }).click();
  const labels = page.getByRole("combobox", { name: "Labels" });
  await labels.fill("gripper");
  await labels.press("Enter");
  const note = page.getByRole("textbox", { name: "Note" });
  await note.fill("The finger was bent.");
  await page.getByRole("button", { name: "Save note" }).click();
  await expect(page.getByRole("button", { name: "Save note" })).toBeHidden();
  await page.goto(`${product.url}/runs`);
  await page.getByRole("textbox", { name: "Search runs" }).fill("finger was bent");
  const rows = page.getByRole("row").filter({ hasText: "chain_3" });
  await expect(rows).toHaveCount(1);
  await expect(rows.getByText("gripper", { exact: true })).toBeVisible();
  await expect(rows.getByLabel("pinned")).toBeVisible();
  await page.getByRole("button", { name: "Saved" }).click();
  await page.getByRole("menuitem", { name: /^Save “/ }).click();
  await page.goto(`${product.url}/runs`);
  await expect(rows).toHaveCount(3);
  await page.getByText("Finished", { exact: true }).click();
  await expect(rows).toHaveCount(2);
  await page.getByText("Failed", { exact: true }).click();
  await expect(rows).toHaveCount(1);
  await expect(rows.getByText("finished: error")).toBeVisible();
  await page.getByRole("button", { name: "Saved" }).click();
  await page.getByRole("menuitem", { name: /finger was bent/ }).click();
  await expect(rows).toHaveCount(1);
});

test("“worked yesterday, fails today” is answered in one look", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs`);
  await page.getByLabel(`Choose run ${good.number} to compare`).check();
  await page.getByLabel(`Choose run ${bad.number} to compare`).check();
  await page.getByRole("button", { name: "Compare the two" }).click();
  await expect(page.getByText(/then Wait 1: true in run \d+, error in run \d+/)).toBeVisible();
  await expect(page.getByText("gripper jammed")).toBeVisible();
  await expect(page.getByText("Both ran exactly the same graph.")).toBeVisible();
  const canvas = page.getByRole("region", { name: "Both runs on the graph" });
  await expect(card(page, "Wait", 1).getByText("1 · first difference")).toBeVisible();
  await expect(canvas.getByText("1 · first difference")).toHaveCount(1);
  await expect(
    page.getByRole("list", { name: "Differences" }).getByRole("listitem").first(),
  ).toHaveText(/^1\s*Wait 1 ended with an error/);
  const lanes = page.getByRole("region", { name: "Both runs over time" });
  await expect(lanes.getByRole("listitem").filter({ hasText: "Wait 1" })).toHaveAttribute(
    "data-parting",
  );
  await page.getByRole("tab", { name: "Step by step" }).click();
  await expect(page.getByRole("row", { name: /Wait 1/ })).toContainText("here they part");
});

test("a comparison of no runs leads to the list of runs", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/compare`);
  await expect(page.getByRole("heading", { name: "Which runs?" })).toBeVisible();
  await page.getByRole("link", { name: "Open the list of runs" }).click();
  await expect(page.getByRole("row").filter({ hasText: "chain_3" }).first()).toBeVisible();
});

test("on a phone nothing that marks the parting lies over a card, a time or the edge", async () => {
  const { page } = ada;
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  const valve = graphs.find(({ name }) => name === "valve_inspection")?.id ?? "";
  const first = await ran({ "*": [QUICK] }, valve);
  const open = [{ after_s: 0.4, result: "on_false" }, QUICK];
  const second = await ran({ "*": [QUICK], IsValveClosed: open }, valve);
  const desktop = page.viewportSize() ?? { width: 1440, height: 900 };
  for (const width of [390, 360]) {
    await page.setViewportSize({ width, height: 844 });
    await page.goto(`${product.url}/runs/compare?a=${first.id}&b=${second.id}`);
    const parted = card(page, "IsValveClosed");
    await expect(parted.getByText(/^1/).first()).toBeVisible();
    await atRest(page);
    const flag = await boxOf(parted.getByText(/^1/).first());
    for (const name of ["DriveTo", "CloseValve", "SendReport", "CallOperator"])
      expect(overlap(flag, await boxOf(card(page, name)))).toBe(false);
    const lanes = page.getByRole("region", { name: "Both runs over time" });
    const mark = await boxOf(lanes.getByText(/^1 · /));
    for (const run of [first, second])
      expect(overlap(mark, await boxOf(lanes.getByText(`run ${run.number}`)))).toBe(false);
    const axis = lanes.getByText(/^[\d.]+ s$/).last();
    for (const each of [mark, await boxOf(axis)])
      expect(each.x + each.width).toBeLessThanOrEqual(width);
  }
  await page.setViewportSize(desktop);
});

test("new runs wait behind a pill, so that nothing moves under the finger", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs`);
  await expect(page.getByRole("row").filter({ hasText: "chain_3" })).toHaveCount(3);
  await ran({ "*": [QUICK] });
  await page.getByRole("button", { name: "1 new run" }).click();
  await expect(page.getByRole("row").filter({ hasText: "chain_3" })).toHaveCount(4);
});

test("a run goes again with one fault, in the simulator", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${good.id}`);
  await page.getByRole("button", { name: "Again" }).click();
  await page.getByRole("menuitem", { name: "With one fault …" }).click();
  await page.getByRole("combobox", { name: "Action" }).click();
  await page.getByRole("option", { name: "Wait 2" }).click();
  await page.getByRole("button", { name: "Run in the simulator" }).click();
  await expect(page).not.toHaveURL(new RegExp(good.id));
  await expect(card(page, "Wait", 2).getByText("error")).toBeVisible({ timeout: 15_000 });
});

test("a run that failed opens as a dry-run at any of its moments, and goes on otherwise", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${bad.id}`);
  await page.getByRole("link", { name: /^Dry-run from/ }).click();
  const bar = page.getByRole("region", { name: "Dry-run" });
  await expect(bar.getByText("Wait 1 runs")).toBeVisible();
  await expect(card(page, "Wait").getByText("true")).toBeVisible(); // as it was then
  await expect(bar.getByText(`in run ${bad.number}`)).toHaveText(/error/);
  await bar.getByRole("button", { name: new RegExp(`^From run ${bad.number}`) }).click();
  await expect(page.getByText("The values of 2 of 2 actions were not seen")).toBeVisible();
  await page.keyboard.press("Escape");
  await bar.getByRole("group").getByRole("button", { name: /true/ }).click();
  await expect(card(page, "Wait", 1).getByText("true")).toBeVisible();
  await expect(card(page, "Wait", 2).getByText("running")).toBeVisible();
});

/** A graph in which the first action hands a value to the second one. */
async function handingOver(): Promise<string> {
  const number = (value: number) => ({ value: { pvf_type: "number", pvf_value: value } });
  const [first, second] = [
    { name: "Measure", instance_id: 0 },
    { name: "Move", instance_id: 0 },
  ];
  const body = JSON.stringify({
    graph_name: "handing_over",
    graph_entry: [first],
    graph_exit: [second],
    actions: [
      { ...first, type: "sync", parents: [], children: [second], output_parameters: number(7) },
      { ...second, type: "sync", parents: [first], children: [], input_parameters: number(5) },
    ],
  });
  const headers = { "content-type": "application/json" };
  return (await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers })).id;
}

test("values as an action ran with them stand beside those that were sent", async () => {
  const { page } = ada;
  const run = await ran({ "*": [QUICK] }, await handingOver());
  await page.goto(`${product.url}/runs/${run.id}`);
  await page.getByRole("tab", { name: "Parameters" }).click();
  const move = page.getByRole("region", { name: "Parameters of Move" });
  await expect(move.getByRole("row", { name: /value/ })).toContainText("5≠ 7");
  // A dry-run that begins at its end has them, too.
  await page.getByRole("slider", { name: "Moment of the run" }).press("End");
  await page.getByRole("link", { name: /^Dry-run from/ }).click();
  await expect(page.getByRole("region", { name: "Dry-run" })).toBeVisible();
  await expect(card(page, "Move")).toContainText("7");
});

test("a run starts again through the dialog of every start, looked at and held", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/${good.id}`);
  await page.getByRole("button", { name: "Again" }).click();
  await page.getByRole("menuitem", { name: "v1 again …" }).click();
  const dialog = page.getByRole("dialog", { name: "Start v1 of chain_3" });
  await expect(dialog.getByRole("radio", { name: /Simulator/ })).toBeChecked();
  const hold = dialog.getByRole("button", { name: "Run v1 in the simulator" });
  await expect(hold).toBeEnabled();
  await hold.focus();
  await page.keyboard.down("Enter");
  await expect(dialog).toBeHidden();
  await page.keyboard.up("Enter");
  await expect(page).not.toHaveURL(new RegExp(good.id));
  await expect(card(page, "Wait", 2).getByText("true")).toBeVisible({ timeout: 15_000 });
});

test("a run is repeated with the newest version of its graph", async () => {
  const { page } = ada;
  await product.ask(`/api/graphs/${graph}`, {
    method: "PATCH",
    body: JSON.stringify({ name: "chain_renamed" }),
    headers: { "content-type": "application/json" },
  });
  await page.goto(`${product.url}/runs/${bad.id}`);
  await page.getByRole("button", { name: "Again" }).click();
  await page.getByRole("menuitem", { name: "As it went, with the newest version" }).click();
  await expect(page.getByRole("link", { name: "chain_renamed" })).toBeVisible();
  await expect(card(page, "Wait", 1).getByText("error")).toBeVisible({ timeout: 15_000 });
  await expect(page.getByRole("region", { name: "Why" })).toContainText(
    "Wait 1 ended in error: “gripper jammed”",
  );
});

test("the list is walked by keys, and the run before is one click away", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs?graph=${graph}`);
  await expect(page.getByRole("rowheader", { name: "today" })).toBeVisible();
  const runs = page.getByRole("link", { name: /^Run \d+/ });
  await runs.last().waitFor();
  await page.keyboard.press("j");
  await page.keyboard.press("j");
  await expect(runs.nth(1)).toBeFocused();
  await page.keyboard.press("k");
  await expect(runs.first()).toBeFocused();
  const failed = page.getByRole("row").filter({ hasText: `Run ${bad.number}` });
  await expect(failed.getByRole("img", { name: /^Course: true, error/ })).toBeVisible();
  await failed.getByRole("link", { name: `Compare with ${good.number}` }).click();
  await expect(page.getByText(/then Wait 1: true in run \d+, error in run \d+/)).toBeVisible();
  await page.goto(`${product.url}/runs/compare?b=${bad.id}`);
  await expect(page.getByText(/then Wait 1: true in run \d+, error in run \d+/)).toBeVisible();
  await page.getByRole("link", { name: "Another run" }).click();
  await expect(page.getByText("Which run do you want to compare with?")).toBeVisible();
});

test("the rarer filters narrow the list, and what was stored can be read as it is", async () => {
  const { page } = ada;
  const rows = page.getByRole("row").filter({ has: page.getByRole("checkbox") });
  await page.goto(`${product.url}/runs`);
  await page.getByRole("button", { name: "Filters" }).click();
  await page.getByRole("combobox", { name: "Graph" }).click();
  await page.getByRole("option", { name: "handing_over" }).click();
  await expect(rows).toHaveCount(1);
  const person = page.getByRole("textbox", { name: "Started by" });
  await person.fill("nobody of this name");
  await person.press("Enter");
  await expect(page.getByText("No run fits")).toBeVisible();
  await person.fill("");
  await person.press("Enter");
  await page.getByLabel("From", { exact: true }).fill("2001-01-01");
  await expect(rows).toHaveCount(1);
  await page.getByLabel("To", { exact: true }).fill("2001-01-02");
  await expect(page.getByText("No run fits")).toBeVisible();
  await page.goto(`${product.url}/runs/${bad.id}`);
  await page.getByRole("tab", { name: "Raw" }).click();
  const stored = page.getByRole("group").filter({ hasText: "run.requested.v1" });
  await stored.getByText("run.requested.v1").click();
  await expect(stored.getByText('"graph_name": "chain_3"')).toBeVisible();
});

test("statistics tell how often it succeeds and which action fails", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs?graph=${graph}`);
  await page.getByRole("link", { name: "Statistics", exact: true }).click();
  await expect(page.getByText(/of \d+ runs finished true/)).toBeVisible();
  await expect(page.getByRole("row", { name: /Wait 1/ })).toBeVisible();
  await expect(page.getByText(/Wait 1.*visits|1 of \d+ visits/).first()).toBeVisible();
});

test("statistics of no graph ask for one, and then name it", async () => {
  const { page } = ada;
  await page.goto(`${product.url}/runs/statistics`);
  await expect(page.getByRole("heading", { name: "Of which graph?" })).toBeVisible();
  const choice = page.getByRole("combobox", { name: "Graph" });
  await choice.click();
  const { name } = await product.ask<{ name: string }>(`/api/graphs/${graph}`);
  await page.getByRole("option", { name, exact: true }).click();
  await expect(page.getByText(/of \d+ runs finished true/)).toBeVisible();
  await expect(choice).toHaveValue(name);
});

test("a part of the time is looked at more closely, and a link carries it", async ({ browser }) => {
  const long = await ran({ "*": [{ after_s: 1.2 }] }, await product.chain(3));
  const { page } = ada;
  await page.goto(`${product.url}/runs/${long.id}`);
  const timeline = page.getByRole("region", { name: "Timeline" });
  const bars = timeline.locator("[data-track] i[data-tone]");
  await expect(bars).toHaveCount(3);
  await page.getByRole("slider", { name: "Moment of the run" }).press("Home");
  await timeline.getByRole("button", { name: "Zoom into the time" }).click();
  await expect(bars).toHaveCount(2); // the third began later
  await timeline.getByRole("button", { name: "Zoom into the time" }).click();
  await expect(bars).toHaveCount(1);
  await expect(timeline.getByText("0.2 s")).toBeVisible();
  await expect.poll(() => new URL(page.url()).searchParams.get("until")).not.toBeNull();
  const shared = page.url();
  await page.getByRole("slider", { name: "Moment of the run" }).press("End");
  const next = page.getByRole("button", { name: "The change before" });
  for (let i = 0; i < 3; i += 1) await next.click();
  await expect(timeline.getByText("0.2 s")).toBeHidden(); // the part goes where the replay is
  await page.goto(shared);
  await expect(bars).toHaveCount(1);
  await timeline.getByRole("button", { name: "All", exact: true }).click();
  await expect(bars).toHaveCount(3);
  const phone = await product.person(browser, "Mari", { viewport: { width: 360, height: 740 } });
  await phone.page.goto(shared);
  await phone.page.getByRole("button", { name: "Zoom out of the time" }).click();
  await expect(phone.page.locator("[data-track] i[data-tone]")).toHaveCount(2);
  await phone.context.close();
});
