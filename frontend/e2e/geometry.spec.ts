/** What is drawn, measured in the page: lines beside cards, pills on nothing, text that can be read. */

import { readdirSync, readFileSync } from "node:fs";
import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { atRest, saved, tidy, umrfOf } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const OURS = resolve(import.meta.dirname, "../../tests/umrf/examples");
const SHARED = process.env.UMRF_SHARED;

/** All files below a folder that may hold a graph. */
function filesIn(folder: string): string[] {
  return readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((each) => each.isFile() && each.name.endsWith(".json"))
    .map((each) => resolve(each.parentPath, each.name))
    .sort();
}

/** What a server made of a body. */
async function made(body: string): Promise<string> {
  const headers = { "content-type": "application/json" };
  return (await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers })).id;
}

/** The graphs of files in whatever dialect; some hold none. */
async function taken(files: readonly string[]): Promise<string[]> {
  const ids: string[] = [];
  for (const file of files) {
    const id = await made(readFileSync(file, "utf8")).catch(() => null);
    if (id !== null) ids.push(id);
  }
  return ids;
}

/** Branches that join, a loop, a handler of errors, values: as tasks are, of any length. */
async function task(count: number): Promise<string> {
  const named = (i: number) => ({
    name: i % 4 === 1 ? "CheckTheGripper" : "DriveTo",
    instance_id: i,
  });
  const says = (...words: string[]) =>
    ["true", "false", "error", "stopped"].map((on, i) => `on_${on} -> ${words[i] ?? "ignore"}`);
  const arrows: { from: number; to: number; conditions: string[] }[] = [];
  for (let i = 0; i + 4 < count; i += 4) {
    arrows.push({ from: i, to: i + 1, conditions: says("run") });
    arrows.push({ from: i + 1, to: i + 2, conditions: says("run", "ignore", "stop") });
    arrows.push({ from: i + 1, to: i + 3, conditions: says("ignore", "run", "run") });
    arrows.push({ from: i + 2, to: i + 4, conditions: says("run", "run") });
    arrows.push({ from: i + 3, to: i + 4, conditions: says("run") });
    if (i % 8 === 0) arrows.push({ from: i + 3, to: i, conditions: says("ignore", "restart") });
  }
  const body = {
    graph_name: `task_of_${count}`,
    graph_entry: [named(0)],
    graph_exit: [named(count - 1)],
    actions: Array.from({ length: count }, (_, i) => ({
      ...named(i),
      type: "sync",
      actor: i % 3 === 0 ? "rover" : "",
      input_parameters: { speed: { pvf_type: "number", pvf_value: i / 8 } },
      parents: arrows
        .filter(({ to }) => to === i)
        .map(({ from, conditions }) => ({ ...named(from), conditions })),
      children: arrows.filter(({ from }) => from === i).map(({ to }) => named(to)),
    })),
  };
  return made(JSON.stringify(body));
}

interface Measured {
  /** Lines that pass a card, pills that lie on a card or on each other. */
  readonly faults: readonly string[];
  /** Texts of less than 11 px on the screen. */
  readonly small: readonly string[];
  /** Texts that are cut without a sign of it. */
  readonly cut: readonly string[];
  readonly lines: number;
}

/** In the page itself: nothing of ours is here. */
function measure(): Measured {
  interface Box {
    name: string;
    left: number;
    top: number;
    right: number;
    bottom: number;
  }
  const boxOf = (element: Element, name: string): Box => {
    const { left, top, right, bottom } = element.getBoundingClientRect();
    return { name, left, top, right, bottom };
  };
  const all = (selector: string) => [...document.querySelectorAll(selector)];
  const cards = all(".react-flow__node-action, .react-flow__node-end").map((node) =>
    boxOf(node.firstElementChild ?? node, node.getAttribute("data-id") ?? ""),
  );
  const pills = all(".react-flow__edgelabel-renderer > [class*=pill]")
    .filter((pill) => getComputedStyle(pill).display !== "none")
    .map((pill, i) => boxOf(pill, `pill ${i} ${pill.textContent}`));
  const faults: string[] = [];
  const meet = (a: Box, b: Box, slack: number) =>
    a.left < b.right - slack &&
    b.left < a.right - slack &&
    a.top < b.bottom - slack &&
    b.top < a.bottom - slack;
  for (const [i, pill] of pills.entries()) {
    for (const other of [...cards, ...pills.slice(i + 1)])
      if (meet(pill, other, 1)) faults.push(`${pill.name} lies on ${other.name}`);
  }
  const paths = all("path.react-flow__edge-path") as SVGPathElement[];
  for (const path of paths) {
    const matrix = path.getScreenCTM();
    const length = path.getTotalLength();
    if (!matrix) continue;
    const passed = new Set<string>();
    for (let at = 0; at <= length; at += 3) {
      const { x, y } = path.getPointAtLength(at).matrixTransform(matrix);
      // A line begins and ends at the side of a card, which has a round corner and a border.
      for (const { name, left, top, right, bottom } of cards)
        if (x > left + 4 && x < right - 4 && y > top + 4 && y < bottom - 4) passed.add(name);
    }
    for (const name of passed) faults.push(`the line ${path.id} passes ${name}`);
  }
  const view = document.querySelector(".react-flow__viewport");
  const zoom = view ? new DOMMatrix(getComputedStyle(view).transform).a : 1;
  const small = new Set<string>();
  const cut: string[] = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const element = node.parentElement;
    if (!element?.checkVisibility({ visibilityProperty: true, opacityProperty: true })) continue;
    if (!node.textContent?.trim() || element.closest("svg, style, script")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    if (box.width < 2 || box.right < 0 || box.left > innerWidth || box.top > innerHeight) continue;
    const style = getComputedStyle(element);
    const around: CSSStyleDeclaration[] = [];
    for (let each: Element | null = element; each; each = each.parentElement)
      around.push(getComputedStyle(each));
    if (around.some(({ clipPath }) => clipPath === "inset(50%)")) continue; // it is read out only
    const scale = around.reduce((all, each) => all * (Number.parseFloat(each.scale) || 1), 1);
    const size = Number.parseFloat(style.fontSize) * (view?.contains(element) ? zoom * scale : 1);
    if (size < 10.95) small.add(`${node.textContent} ${size}`);
    for (let holder: HTMLElement | null = element; holder; holder = holder.parentElement) {
      const look = getComputedStyle(holder);
      if (look.overflowX !== "hidden" && look.overflowX !== "clip") continue;
      const shown = holder.getBoundingClientRect();
      const over = box.right - shown.right > 2 || shown.left - box.left > 2;
      const told = look.textOverflow === "ellipsis" || look.webkitLineClamp !== "none";
      if (over && !told && !holder.matches(".react-flow, main, body, html"))
        cut.push(`${node.textContent} in ${holder.className}`);
      break;
    }
  }
  return { faults, small: [...small], cut, lines: paths.length };
}

/** Once lines have come from their worker and nothing moves any more. */
async function measured(page: Page): Promise<Measured> {
  let before = "";
  await expect
    .poll(
      async () => {
        const now = JSON.stringify(await page.evaluate(measure));
        const same = now === before;
        before = now;
        return same;
      },
      { intervals: [300] },
    )
    .toBe(true);
  return JSON.parse(before) as Measured;
}

test("tidied graphs have lines beside their cards, pills on nothing, and text that can be read", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  test.setTimeout(600_000);
  const { page, context, failures } = await product.person(browser, "Ada", {
    viewport: { width: 1440, height: 900 },
  });
  const examples = await product.ask<{ id: string }[]>("/api/graphs");
  const files = [
    ...filesIn(OURS),
    ...(SHARED ? filesIn(resolve(SHARED, "umrf/corpus/graphs")) : []),
  ];
  const ids = [...examples.map(({ id }) => id), ...(await taken(files))];
  const tasks: string[] = [];
  for (const count of [5, 9, 25]) tasks.push(await task(count));
  expect(ids.length).toBeGreaterThan(examples.length + 3);
  let lines = 0;
  for (const id of [...ids, ...tasks]) {
    if ((await umrfOf(product, id)).actions.length === 0) continue;
    await page.goto(`${product.url}/graphs/${id}`);
    await saved(page);
    for (const direction of tasks.includes(id) ? ["as it is", "the other"] : ["as it is"]) {
      if (direction === "the other") await page.keyboard.press("Shift+D");
      await tidy(page);
      const seen = await measured(page);
      lines += seen.lines;
      const name = await page.getByRole("heading", { level: 1 }).textContent();
      const { faults, small, cut } = seen;
      expect.soft({ name, direction, faults, small, cut }).toEqual({
        ...{ name, direction, faults: [], small: [], cut: [] },
      });
    }
  }
  expect(lines).toBeGreaterThan(100);
  expect(failures).toEqual([]);
  await context.close();
});

test("no card lies under the map as a graph opens, and the map comes as the view is moved", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Mari", { panels: "folded" });
  const map = page.getByRole("img", { name: "Map of the canvas", includeHidden: true });
  for (const count of [60, 300]) {
    await page.goto(`${product.url}/graphs/${await task(count)}`);
    await saved(page);
    await expect(map).toBeAttached();
    await atRest(page);
    const under = () =>
      map.evaluate((element) => {
        const { left, top, right, bottom } = element.getBoundingClientRect();
        const isUnder = (node: Element) => {
          const box = node.getBoundingClientRect();
          return box.left < right && box.right > left && box.top < bottom && box.bottom > top;
        };
        const nodes = [...document.querySelectorAll(".react-flow__node-action")];
        return {
          shown: element.checkVisibility({ visibilityProperty: true }),
          cards: nodes.filter(isUnder).length,
        };
      });
    const { shown, cards } = await under();
    expect({ count, covered: shown ? cards : 0 }).toEqual({ count, covered: 0 });
    await page.mouse.move(700, 450);
    await page.mouse.wheel(0, -240);
    await expect(map).toBeVisible();
  }
  expect(failures).toEqual([]);
  await context.close();
});
