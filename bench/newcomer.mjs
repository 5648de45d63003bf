/**
 * What it costs somebody new to draw a graph by mouse: `node bench/newcomer.mjs URL` with the token of
 * that server in ACTION_ASSISTANT_TOKEN.
 *
 * Eight actions with a branch, a join, a loop, a handler of errors and two parameters are drawn in a
 * real page. Seconds are those of the keystroke-level model (Card, Moran, Newell 1980), so that they
 * do not depend on the machine: 1.1 s to point at something, 0.1 s to press or let go, 0.28 s for a
 * key, 0.4 s to move the hand between mouse and keys, 1.35 s to think before each step.
 */
import { existsSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const require = createRequire(resolve(import.meta.dirname, "../frontend/package.json"));
const { chromium } = require("@playwright/test");
const [address] = process.argv.slice(2);
const token = process.env.ACTION_ASSISTANT_TOKEN ?? "";
const S = { point: 1.1, press: 0.1, key: 0.28, home: 0.4, think: 1.35 };

const count = { clicks: 0, drags: 0, keys: 0, seconds: 0 };
let page;

const middle = async (locator) => {
  await locator.first().waitFor();
  // What glides is pressed when it rests.
  for (let before = ""; ; ) {
    const box = await locator.first().boundingBox();
    if (box && JSON.stringify(box) === before) return [box.x + box.width / 2, box.y + box.height / 2];
    before = JSON.stringify(box);
    await page.waitForTimeout(120);
  }
};

async function click(locator) {
  await page.mouse.move(...(await middle(locator)), { steps: 4 });
  await page.mouse.down();
  await page.mouse.up();
  count.clicks += 1;
  count.seconds += S.think + S.point + 2 * S.press;
}

async function type(text) {
  await page.keyboard.type(text);
  await page.keyboard.press("Enter");
  count.keys += text.length + 1;
  count.seconds += 2 * S.home + (text.length + 1) * S.key;
}

const card = (name) =>
  page.locator(".react-flow__node-action").filter({
    has: page.getByLabel(`Input of ${name} 0`, { exact: true }),
  });

async function drag(from, to) {
  const start = await middle(from);
  const box = await to.first().boundingBox();
  const end = [box.x + box.width / 2, box.y + Math.min(10, box.height / 2)];
  await page.mouse.move(...start, { steps: 4 });
  await page.mouse.down();
  await page.mouse.move(end[0], end[1] - 14, { steps: 8 });
  await page.mouse.move(...end, { steps: 4 });
  await page.mouse.up();
  count.drags += 1;
  count.seconds += S.think + 2 * S.point + 2 * S.press;
}

const button = (name) => page.getByRole("button", { name, exact: true });

/** Its ports may be seen only while the pointer is on a card. */
async function arrow(from, outcome, to) {
  await card(from).first().hover({ position: { x: 40, y: 12 } });
  const goal =
    to === "exit"
      ? page.locator(".react-flow__node").filter({ has: page.getByLabel("End with") })
      : card(to);
  await drag(card(from).getByLabel(`When ${outcome}`, { exact: true }), goal);
}

async function parameter(of, name, value) {
  await click(card(of));
  await click(button("Add"));
  await type(name);
  await click(page.getByRole("textbox", { name: new RegExp(`^${name}`) }));
  await type(value);
}

const NAMES = ["Wake", "Scan", "Pinch", "Swing", "Gather", "Judge", "Wrap", "Rescue"];
const ARROWS = [
  ["Wake", "true", "Scan"],
  ["Scan", "true", "Pinch"], // the branch
  ["Scan", "true", "Swing"],
  ["Pinch", "true", "Gather"], // the join
  ["Swing", "true", "Gather"],
  ["Gather", "true", "Judge"],
  ["Judge", "true", "Wrap"],
  ["Judge", "false", "Scan"], // the loop
  ["Wake", "error", "Rescue"], // the handler
  ["Wrap", "true", "exit"],
  ["Rescue", "true", "exit"],
];

const ask = async (path) =>
  (await fetch(address + path, { headers: { authorization: `Bearer ${token}` } })).json();

async function drawn(id) {
  const { graph_entry, graph_exit, actions } = await ask(`/api/graphs/${id}/umrf`);
  const parents = actions.flatMap((action) => action.parents ?? []);
  return { actions: actions.length, arrows: graph_entry.length + graph_exit.length + parents.length };
}

async function draw() {
  await click(button("New graph"));
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1);
  for (const name of NAMES) {
    await click(page.getByRole("button", { name: "Add an action" }));
    await page.getByRole("combobox", { name: "Name of an action" }).waitFor();
    await type(name);
    await card(name).first().waitFor({ state: "attached" });
  }
  await click(page.getByRole("button", { name: /^Tidy/ }));
  await click(button("Fit"));
  await page.waitForTimeout(800);
  for (const [from, outcome, to] of ARROWS) await arrow(from, outcome, to);
  const { arrows } = await drawn(id);
  // Where nothing is drawn from the entry, the person has to do it.
  if (arrows < ARROWS.length + 1) await drag(page.getByLabel("Start with"), card("Wake"));
  await parameter("Wake", "place", "dock");
  await parameter("Pinch", "force", "12");
  await page.waitForTimeout(1500);
  return id;
}

const SHELL = "/usr/bin/chromium-headless-shell";
const installed = existsSync(SHELL) ? SHELL : "/usr/bin/chromium";
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? installed,
  args: ["--no-sandbox", "--disable-gpu"],
});
page = await browser.newPage({ viewport: { width: 1440, height: 900 } });
await page.goto(`${address}/#t=${token}`);
// The name is asked once for each browser, not for each graph.
const name = page.getByRole("textbox", { name: /others see you/i });
await page.getByRole("button", { name: "New graph" }).first().waitFor();
if (await name.isVisible()) {
  await name.fill("Ada");
  await name.press("Enter");
}
const id = await draw();
if (process.env.SCREENSHOT) await page.screenshot({ path: process.env.SCREENSHOT });
console.log(JSON.stringify({ ...count, seconds: Math.round(count.seconds), drawn: await drawn(id) }));
await browser.close();
