/** How fast the page is: opening, typing, dragging, tidying, frames beside 20 others, following a run. */

import { spawn } from "node:child_process";
import { mkdirSync, readdirSync, readFileSync, writeFileSync } from "node:fs";
import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { boxOf, saved, start } from "./canvas";
import { Product, pause, TOKEN } from "./product";

const ROOT = resolve(import.meta.dirname, "../..");
const SIZES = [300, 1000, 3000];
const OTHERS = 20;
const product = new Product();
const rows: string[][] = [];
const frames: string[][] = [];
const followed: string[][] = [];
const stepped: string[][] = [];
const nested: string[][] = [];
/** Actions of all levels, and how many levels there are. */
const HIERARCHIES = [
  [1000, 1],
  [300, 2],
  [1000, 3],
  [2000, 5],
  [3000, 5],
] as const;
const PASTS = [1_000, 10_000, 100_000];

test.skip(process.env.SPEED === undefined, "measures; started by `make performance`");
// The recorder of failures takes pictures of the page, which cost as much as what is measured.
test.use({ trace: "off", screenshot: "off" });
test.describe.configure({ mode: "serial", timeout: 300_000 });
test.beforeAll(async () => {
  const python = resolve(ROOT, ".venv/bin/python");
  const writes = spawn(python, [resolve(import.meta.dirname, "long_past.py"), product.data]);
  expect(await new Promise((done) => writes.once("exit", done))).toBe(0);
  await product.start();
});
test.afterAll(() => product.dispose());
test.afterEach(() => {
  mkdirSync(resolve(ROOT, "frontend/test-results"), { recursive: true });
  const head = ["actions", "open", "of that CPU", "key to paint", "drag: frame", "longest", "tidy"];
  const tables = [
    { head, rows },
    { head: ["1,000 actions", "frame (median)", "95 %", "99 %", "longest", "CPU"], rows: frames },
    { head: ["changes (actions)", "key to paint (median)", "longest"], rows: stepped },
    {
      head: ["actions in levels", "expand all", "longest frame", "zooming: frame", "longest"],
      rows: nested,
    },
    { head: ["a run of 70 actions", "page's thread", "whole browser"], rows: followed },
  ];
  writeFileSync(resolve(ROOT, "frontend/test-results/speed.json"), JSON.stringify(tables));
});

/** A field of actions, each led to from the one above it. */
async function field(size: number): Promise<string> {
  const named = (n: number) => ({ name: "Step", instance_id: n });
  const wide = Math.ceil(Math.sqrt(size));
  const graph = {
    graph_name: `field_${size}`,
    graph_entry: Array.from({ length: wide }, (_, n) => named(n)),
    graph_exit: [named(size - 1)],
    actions: Array.from({ length: size }, (_, n) => ({
      ...named(n),
      type: "sync",
      input_parameters: { speed: { pvf_type: "number", pvf_value: n } },
      parents: n < wide ? [] : [named(n - wide)],
      children: n + wide < size ? [named(n + wide)] : [],
      gui_attributes: { position: { x: (n % wide) * 260, y: 200 + Math.floor(n / wide) * 190 } },
    })),
  };
  const body = JSON.stringify(graph);
  const headers = { "content-type": "application/json" };
  return (await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers })).id;
}

/** Waits until cards are there and the room is in sync. */
async function shown(page: Page): Promise<void> {
  await expect(page.locator(".react-flow__node-action").nth(3)).toBeVisible({ timeout: 120_000 });
  await saved(page);
}

/** For how long the page's own thread has worked since its navigation began, in ms of processor. */
async function busyWith(page: Page): Promise<() => Promise<number>> {
  const tools = await page.context().newCDPSession(page);
  await tools.send("Performance.enable", { timeDomain: "threadTicks" });
  return async () => {
    const { metrics } = await tools.send("Performance.getMetrics");
    return 1000 * (metrics.find(({ name }) => name === "TaskDuration")?.value ?? Number.NaN);
  };
}

/** The times between frames from now on, in ms, until they are asked for. */
async function watchFrames(page: Page): Promise<() => Promise<number[]>> {
  const gaps = await page.evaluateHandle(() => {
    const gaps: number[] = [];
    let last = performance.now();
    const look = (now: number) => {
      gaps.push(now - last);
      last = now;
      requestAnimationFrame(look);
    };
    requestAnimationFrame(look);
    return gaps;
  });
  return async () => (await gaps.jsonValue()).slice(1).sort((a, b) => a - b);
}

const share = (sorted: number[], part: number): number =>
  sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * part))] ?? Number.NaN;
const ms = (value: number): string => `${value.toFixed(value < 100 ? 1 : 0)} ms`;

/** From each key to the frame that shows it, as the browser itself tells; none of 16 ms and less. */
async function keyTimes(page: Page): Promise<() => Promise<number[]>> {
  const seen = await page.evaluateHandle(() => {
    const durations: number[] = [];
    const options = { type: "event", durationThreshold: 16 } as PerformanceObserverInit;
    new PerformanceObserver((list) => {
      for (const entry of list.getEntries())
        if (entry.name === "keydown") durations.push(entry.duration);
    }).observe(options);
    return durations;
  });
  return async () => {
    await pause(500);
    return (await seen.jsonValue()).sort((a, b) => a - b);
  };
}

async function type(page: Page): Promise<number> {
  const name = page.getByRole("textbox", { name: "Name", exact: true }).first();
  await name.click();
  const seen = await keyTimes(page);
  await page.keyboard.type("abcdefghijklmnopqrst", { delay: 60 });
  const durations = await seen();
  return durations.length === 0 ? 16 : share(durations, 0.5);
}

/** One of the cards on which nothing lies. */
async function cardInSight(page: Page, which: number) {
  const keys = await page.locator(".react-flow__node-action").evaluateAll((cards) =>
    cards
      .filter((card) => {
        const { left, top, width, height } = card.getBoundingClientRect();
        const hits = [0.1, 0.9].map((share) =>
          document.elementFromPoint(left + width * share, top + height / 2),
        );
        return hits.every((hit) => hit !== null && card.contains(hit));
      })
      .map((card) => card.getAttribute("data-id")),
  );
  return page.locator(`.react-flow__node[data-id="${keys[which]}"]`);
}

async function dragACard(page: Page): Promise<number[]> {
  const box = await boxOf(await cardInSight(page, 0));
  const [x, y] = [box.x + box.width / 4, box.y + box.height / 2];
  await page.mouse.move(x, y);
  await page.mouse.down();
  const gaps = await watchFrames(page);
  for (let step = 1; step <= 60; step += 1) {
    await page.mouse.move(x + step * 2, y + step);
    await pause(10);
  }
  await page.mouse.up();
  return gaps();
}

for (const size of SIZES) {
  test(`${size} actions`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada");
    const id = await field(size);
    const before = Date.now();
    await page.goto(`${product.url}/graphs/${id}`);
    const busy = await busyWith(page);
    await shown(page);
    const opened = Date.now() - before;
    const worked = await busy();
    const drag = await dragACard(page);
    const moved = await cardInSight(page, 1);
    await moved.click();
    const key = await type(page);
    const stood = await moved.getAttribute("style");
    const tidy = Date.now();
    await page.getByRole("button", { name: /^Tidy/ }).first().click();
    // Where it stands now may be out of sight, where nothing is drawn.
    const stands = async () => ((await moved.count()) === 0 ? "" : moved.getAttribute("style"));
    await expect.poll(stands, { timeout: 60_000, intervals: [20] }).not.toBe(stood);
    await saved(page);
    const tidied = Date.now() - tidy;
    const figures = [
      ms(opened),
      ms(worked),
      ms(key),
      ms(share(drag, 0.5)),
      ms(share(drag, 1)),
      ms(tidied),
    ];
    rows.push([size.toLocaleString("en"), ...figures]);
    expect(drag.length).toBeGreaterThan(0);
    await context.close();
  });
}

/** Levels of as many actions each: the last action of each stands for the next. */
async function hierarchy(size: number, levels: number): Promise<string> {
  let id = "";
  for (let level = levels - 1; level >= 0; level -= 1) {
    const count = Math.floor(size / levels);
    const wide = Math.ceil(Math.sqrt(count));
    const names = Array.from({ length: count }, () => "Step");
    if (level < levels - 1) names.push(`level_${size}_${level + 1}`);
    const named = (n: number) => ({ name: names[n] ?? "", instance_id: n });
    const graph = {
      graph_name: `level_${size}_${level}`,
      graph_entry: [named(0)],
      graph_exit: [named(names.length - 1)],
      actions: names.map((_, n) => ({
        ...named(n),
        type: "sync",
        parents: n < wide ? [] : [named(n - wide)],
        children: n + wide < names.length ? [named(n + wide)] : [],
        gui_attributes: { position: { x: (n % wide) * 260, y: Math.floor(n / wide) * 190 } },
      })),
    };
    const body = JSON.stringify(graph);
    const headers = { "content-type": "application/json" };
    id = (await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers })).id;
  }
  return id;
}

for (const [size, levels] of HIERARCHIES) {
  test(`${size} actions in ${levels} levels`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada");
    await page.goto(`${product.url}/graphs/${await hierarchy(size, levels)}`);
    await shown(page);
    await page.keyboard.press("f");
    await pause(1_000);
    const inner = page.locator("[data-inner]");
    const gaps = await watchFrames(page);
    let expanded = 0;
    for (let level = 1; level < levels; level += 1) {
      await page.keyboard.press("Control+k");
      await page.keyboard.type("one level more");
      const before = Date.now();
      await page.keyboard.press("Enter");
      const wanted = Math.floor(size / levels) * level;
      const poll = { timeout: 60_000, intervals: [20] };
      await expect.poll(() => inner.count(), poll).toBeGreaterThanOrEqual(wanted);
      expanded += Date.now() - before;
    }
    const longest = share(await gaps(), 1);
    await page.keyboard.press("f");
    await pause(1_500);
    const box = await boxOf(page.locator(".react-flow__pane"));
    const pans = await watchFrames(page);
    for (let step = 0; step < 60; step += 1) {
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await page.mouse.wheel(0, step % 2 === 0 ? -40 : 30);
      await pause(16);
    }
    const panned = await pans();
    const own = levels === 1 ? ["", ""] : [ms(expanded), ms(longest)];
    const figures = [...own, ms(share(panned, 0.5)), ms(share(panned, 1))];
    nested.push([`${size.toLocaleString("en")} in ${levels}`, ...figures]);
    await context.close();
  });
}

test(`a graph of 1,000 actions while ${OTHERS} people edit it`, async ({ browser }) => {
  const { page, context } = await product.person(browser, "Ada");
  const id = await field(1000);
  await page.goto(`${product.url}/graphs/${id}`);
  await shown(page);
  await pause(3000); // what opening leaves to do
  await watch(page, "alone");
  const plan = {
    ...{ port: product.port, pid: process.pid, dialect: "plain", operation: "idle" },
    ...{ path: "/api/graphs/{room}/room", rooms: [id], people: OTHERS, rate: 2, seconds: 9 },
    headers: [`Authorization: Bearer ${TOKEN}`],
  };
  const others = spawn(resolve(ROOT, ".venv/bin/python"), [
    resolve(ROOT, "bench/editors.py"),
    JSON.stringify(plan),
  ]);
  const ended = new Promise((done) => others.once("exit", done));
  await pause(3000);
  const profiled = await profile(page, process.env.PROFILE);
  await watch(page, `${OTHERS} people, 40 edits/s`);
  await profiled();
  expect(await ended).toBe(0);
  await context.close();
});

const STEPS = 24;

for (const changes of PASTS) {
  test(`steps through a past of ${changes} changes`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada");
    const path = `/graphs/past${changes}`;
    const middle = changes / 2 + 100;
    await product.ask(`/api${path}/document?at=${middle}`); // the index is made once, by whoever asks first
    await page.goto(`${product.url}${path}?at=${middle}&with=${middle - 400}`);
    const moment = page.getByRole("slider", { name: "Moment of the past" });
    const shownMoment = page.locator("[data-past][data-at]");
    await expect(shownMoment).toBeVisible({ timeout: 180_000 });
    await pause(3000); // the steps around it arrive, and what opening leaves to do is done
    await moment.focus();
    const seen = await keyTimes(page);
    const profiled = await profile(page, process.env.PROFILE);
    for (let step = 0; step < STEPS; step += 1) {
      const before = await shownMoment.getAttribute("data-at");
      await page.keyboard.press(step % 3 === 2 ? "ArrowRight" : "ArrowLeft");
      await expect(shownMoment).not.toHaveAttribute("data-at", before ?? "");
      await pause(120);
    }
    await profiled();
    const times = await seen();
    const quick = Array.from({ length: Math.max(0, STEPS - times.length) }, () => 16);
    const sorted = [...quick, ...times].sort((a, b) => a - b);
    const cards = (await product.ask<object>(`/api${path}/document?at=${middle}`)) as {
      actions: Record<string, unknown>;
    };
    const actions = Object.keys(cards.actions).filter((key) => !key.includes("|")).length;
    const what = `${changes.toLocaleString("en")} (${actions.toLocaleString("en")})`;
    stepped.push([what, ms(share(sorted, 0.5)), ms(share(sorted, 1))]);
    await context.close();
  });
}

/** How long all processes of browsers on this machine have worked, ms of processor. */
function browserWorked(): number {
  const ticks = readdirSync("/proc").flatMap((id) => {
    try {
      if (!/^\d+$/.test(id) || !readFileSync(`/proc/${id}/cmdline`, "utf8").includes("chrom"))
        return [];
      const [, fields = ""] = readFileSync(`/proc/${id}/stat`, "utf8").split(") ");
      const [user, system] = fields.split(" ").slice(11, 13).map(Number);
      return [(user ?? 0) + (system ?? 0)];
    } catch {
      return []; // it has just ended
    }
  });
  return 10 * ticks.reduce((sum, each) => sum + each, 0); // 100 ticks a second
}

for (const reducedMotion of ["no-preference", "reduce"] as const) {
  test(`a run of 70 actions, motion: ${reducedMotion}`, async ({ browser }) => {
    const { page, context } = await product.person(browser, "Ada", { reducedMotion });
    const id = await product.chain(70);
    await page.goto(`${product.url}/graphs/${id}`);
    await shown(page);
    await page.getByRole("button", { name: "Tidy", exact: true }).click();
    await start(page);
    await pause(4_000);
    const busy = await busyWith(page);
    const profiled = await profile(page, process.env.PROFILE);
    const [thread, whole, before] = [await busy(), browserWorked(), performance.now()];
    await pause(30_000);
    const seconds = (performance.now() - before) / 1000;
    const share = (worked: number) => `${(worked / (10 * seconds)).toFixed(1)} %`;
    const motion = reducedMotion === "reduce" ? "with reduced motion" : "followed";
    await profiled();
    followed.push([motion, share((await busy()) - thread), share(browserWorked() - whole)]);
    await page.getByRole("button", { name: /^Stop run/ }).click();
    await context.close();
  });
}

const WATCHED = 5; // s

/** A row about the frames of the next seconds, and how much of a processor the page's thread takes. */
async function watch(page: Page, what: string): Promise<void> {
  const [gaps, busy] = [await watchFrames(page), await busyWith(page)];
  const before = await busy();
  await pause(WATCHED * 1000);
  const cpu = ((await busy()) - before) / (10 * WATCHED);
  const sorted = await gaps();
  const parts = [0.5, 0.95, 0.99, 1].map((part) => ms(share(sorted, part)));
  frames.push([what, ...parts, `${cpu.toFixed(0)} %`]);
}

/** Writes a profile of the page's thread to `file` when asked; the tools of Chromium open it. */
async function profile(page: Page, file: string | undefined): Promise<() => Promise<void>> {
  if (file === undefined) return async () => {};
  const tools = await page.context().newCDPSession(page);
  await tools.send("Profiler.enable");
  await tools.send("Profiler.setSamplingInterval", { interval: 500 });
  await tools.send("Profiler.start");
  return async () => {
    const { profile } = await tools.send("Profiler.stop");
    writeFileSync(file, JSON.stringify(profile));
  };
}
