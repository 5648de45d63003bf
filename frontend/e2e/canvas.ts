/** What a person does on the canvas and beside it, as a hand on the mouse does it. */

import { expect, type Locator, type Page } from "@playwright/test";
import type { Product } from "./product";

export type Outcome = "true" | "false" | "error" | "stopped";

/** The card of an action. */
export function card(page: Page, name: string, instance = 0): Locator {
  return page.locator(".react-flow__node-action").filter({
    has: page.getByLabel(`Input of ${name} ${instance}`, { exact: true }),
  });
}

/** Adds an action that nobody knows yet by typing its name. */
export async function add(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Add an action" }).first().click();
  const field = page.getByRole("combobox", { name: "Name of an action" });
  await field.fill(name);
  await page.getByRole("option", { name: `New action “${name}”` }).click();
  await expect(card(page, name)).toBeVisible();
}

/** Says whose an action is. */
export async function setRobot(page: Page, action: string, robot: string): Promise<void> {
  await card(page, action).click({ position: { x: 40, y: 24 } });
  const field = page.getByRole("combobox", { name: "Robot" });
  await field.fill(robot);
  await field.press("Tab");
}

/** Drags an arrow from one of the four outcomes of an action to another one, or to the exit. */
export async function connect(
  page: Page,
  from: string,
  outcome: Outcome,
  to: string,
): Promise<void> {
  const source = card(page, from).getByLabel(`When ${outcome}`, { exact: true });
  await drag(page, source, to === "exit" ? exit(page) : card(page, to));
}

/** Draws the arrow from the entry; the first action of a graph has it already. */
export async function enter(page: Page, to: string): Promise<void> {
  if ((await page.locator(`[aria-label^="Arrow from entry to ${to}"]`).count()) > 0) return;
  await drag(page, page.getByLabel("Start with", { exact: true }), card(page, to));
}

function entry(page: Page): Locator {
  return page.locator(".react-flow__node").filter({ has: page.getByLabel("Start with") });
}

function exit(page: Page): Locator {
  return page.locator(".react-flow__node").filter({ has: page.getByLabel("End with") });
}

/** Moves a card to a place seen from another card, in its own pixels; the canvas may be zoomed. */
export async function move(
  page: Page,
  name: string,
  [dx, dy]: readonly [number, number],
  anchor: string,
): Promise<void> {
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  const origin = await boxOf(anchor === "entry" ? entry(page) : card(page, anchor));
  const box = await boxOf(card(page, name));
  const zoom = box.width / CARD_WIDTH;
  const from = [box.x + box.width / 4, box.y + box.height / 3] as const; // beside the input
  const x = from[0] + middle(origin) + dx * zoom - middle(box);
  const y = from[1] + origin.y + dy * zoom - box.y;
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move((from[0] + x) / 2, (from[1] + y) / 2, { steps: 6 });
  await page.mouse.move(x, y, { steps: 6 });
  await page.mouse.up();
  await page.getByRole("button", { name: "Fit", exact: true }).click();
}

const CARD_WIDTH = 208; // px at zoom 1

function middle(box: { x: number; width: number }): number {
  return box.x + box.width / 2;
}

async function drag(page: Page, from: Locator, to: Locator): Promise<void> {
  // What is looked at last rests, so both do.
  const end = await boxOf(to);
  const start = await boxOf(from);
  const arrows = await page.locator(".react-flow__edge").count();
  await page.mouse.move(start.x + start.width / 2, start.y + start.height / 2);
  await page.mouse.down();
  const target = [end.x + end.width / 2, end.y + 8] as const;
  await page.mouse.move(target[0], target[1] - 20, { steps: 8 });
  await page.mouse.move(...target, { steps: 4 });
  await page.mouse.up();
  await expect.poll(() => page.locator(".react-flow__edge").count()).toBeGreaterThan(arrows);
}

/** Where something is once it has come to rest: the canvas glides when it shows all. */
export async function boxOf(locator: Locator) {
  // A card that glides out of sight is taken out of the page, and another one is found.
  await expect(() => locator.scrollIntoViewIfNeeded()).toPass();
  let before = "";
  for (;;) {
    const box = await locator.boundingBox();
    if (box === null) throw new Error(`${locator} is not on screen`);
    const now = JSON.stringify(box);
    if (now === before) return box;
    before = now;
    // Counted in frames: a busy machine draws few of them, and between two frames nothing can move.
    await frames(locator.page(), 8);
  }
}

/** Waits until the page has drawn this many frames. */
export async function frames(page: Page, count: number): Promise<void> {
  await page.evaluate(
    (all) =>
      new Promise<void>((done) => {
        const next = (left: number) =>
          left > 0 ? requestAnimationFrame(() => next(left - 1)) : done();
        next(all);
      }),
    count,
  );
}

/** After this many frames in a row without any movement the page is at rest. */
const STILL_FRAMES = 12;
/** The bars of a run grow by animations over minutes; what ends sooner is a movement of the page. */
const LONGEST_MOVE_MS = 10_000;

/** Waits until nothing is loading, no part of the canvas moves, and no animation that ends soon is running. */
export async function atRest(page: Page): Promise<void> {
  await expect(page.locator(".mantine-Skeleton-root")).toHaveCount(0);
  await page.evaluate(
    ({ least, longest }) =>
      new Promise<void>((done) => {
        let before = "";
        let still = 0;
        const look = () => {
          const parts = document.querySelectorAll(".react-flow__viewport, .react-flow__node");
          const now = [...parts].map((part) => JSON.stringify(part.getBoundingClientRect())).join();
          const isMoving = document
            .getAnimations()
            .some(
              ({ playState, effect }) =>
                playState === "running" && Number(effect?.getComputedTiming().endTime) < longest,
            );
          still = now === before && !isMoving ? still + 1 : 0;
          before = now;
          if (still >= least) done();
          else requestAnimationFrame(look);
        };
        look();
      }),
    { least: STILL_FRAMES, longest: LONGEST_MOVE_MS },
  );
}

/** Presses the button *Fit* and waits until the view has come to rest. */
export async function fitView(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await atRest(page);
}

/**
 * Holds a button for as long as it asks for, or presses one that is not to be held; `down` and `up` are those
 * of a mouse, a key or a finger.
 */
export async function hold(
  button: Locator,
  down: () => Promise<unknown>,
  up: () => Promise<unknown>,
): Promise<void> {
  const element = await button.elementHandle();
  if (element === null) throw new Error(`${button} is not there`);
  if (!(await element.getAttribute("title"))?.endsWith("(hold)")) {
    await down();
    await up();
    return;
  }
  await element.evaluate((pressed) => {
    const held = new Promise<void>((done) => {
      let isHeld = false;
      const look = () => {
        const was = isHeld;
        isHeld = pressed.hasAttribute("data-holding");
        if ((was && !isHeld) || !pressed.isConnected) done();
      };
      const watch = { subtree: true, childList: true, attributeFilter: ["data-holding"] };
      new MutationObserver(look).observe(document, watch);
    });
    Object.assign(pressed, { held });
  });
  await down();
  await element.evaluate((pressed) => Reflect.get(pressed, "held") as Promise<void>);
  await up();
}

/** Holds a button by the key Enter. */
export async function holdEnter(page: Page, button: Locator): Promise<void> {
  await button.focus();
  await hold(
    button,
    () => page.keyboard.down("Enter"),
    () => page.keyboard.up("Enter"),
  );
}

/** Lays out the graph, which takes a moment. */
export async function tidy(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Tidy", exact: true }).click();
  await expect(page.getByLabel("What happens")).toContainText("arranged");
}

/** Waits until everything is on disk, also where things stand in a graph that was opened anew. */
export async function saved(page: Page): Promise<void> {
  const stored = page.getByText("Saved", { exact: true });
  const busy = page.locator("main [aria-busy=true]:not([aria-label=Run])");
  // A page without its canvas yet is not busy either.
  await expect(stored).toBeVisible({ timeout: 30_000 });
  await expect(busy).toHaveCount(0, { timeout: 30_000 });
  await expect(stored).toBeVisible();
}

/** Starts a run in the simulator. */
export async function start(page: Page): Promise<void> {
  const button = page.getByRole("button", { name: /^Run v\d+ in the simulator/ });
  await expect(button).toBeEnabled();
  const box = await boxOf(button);
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await hold(
    button,
    () => page.mouse.down(),
    () => page.mouse.up(),
  );
}

/** Gives an action a parameter of text with a value. */
export async function give(page: Page, to: string, name: string, value: string): Promise<void> {
  await card(page, to).click({ position: { x: 50, y: 30 } });
  await page.getByRole("button", { name: "Add", exact: true }).first().click();
  const field = page.getByRole("combobox", { name: "Name of the parameter" });
  await field.fill(name);
  await field.press("Enter");
  const input = page.getByRole("textbox", { name: new RegExp(`^${name}`) });
  await input.fill(value);
  await input.press("Enter");
}

/** Notes from now on which actions the page shows as running, however short that is. */
export async function watch(page: Page): Promise<void> {
  await page.evaluate(() => {
    const seen = new Set<string>();
    Object.assign(window, { seenRunning: seen });
    setInterval(() => {
      for (const shown of document.querySelectorAll<HTMLElement>(
        ".react-flow__node-action [data-name]",
      )) {
        const name = shown.dataset.name;
        if (name !== undefined && shown.textContent?.includes("running")) seen.add(name);
      }
    }, 20);
  });
}

/** The actions that the page has shown as running since `watch`. */
export function seenRunning(page: Page): Promise<string[]> {
  return page.evaluate(() => [...(Reflect.get(window, "seenRunning") as Set<string>)].sort());
}

interface Reference {
  readonly name: string;
  readonly instance_id: number;
  readonly conditions?: readonly string[];
  readonly required?: boolean;
}

/** What of an exported file tests look at. */
export interface Umrf {
  readonly graph_name: string;
  readonly graph_entry: readonly Reference[];
  readonly graph_exit: readonly Reference[];
  readonly actions: readonly (Reference & {
    readonly parents?: readonly Reference[];
    readonly gui_attributes?: { readonly position?: { readonly x: number; readonly y: number } };
  })[];
}

/** A graph as the server exports it. */
export function umrfOf(product: Product, id: string): Promise<Umrf> {
  return product.ask<Umrf>(`/api/graphs/${id}/umrf`);
}

/** The arrows of a graph as the server has it: `Check_0 > Drive_1`, sorted. */
export async function arrows(product: Product, id: string): Promise<string[]> {
  const { graph_entry, graph_exit, actions } = await umrfOf(product, id);
  const named = ({ name, instance_id }: Reference) => `${name}_${instance_id}`;
  return [
    ...graph_entry.map((first) => `entry > ${named(first)}`),
    ...actions.flatMap((action) =>
      (action.parents ?? []).map((parent) => `${named(parent)} > ${named(action)}`),
    ),
    ...graph_exit.map((last) => `${named(last)} > exit`),
  ].sort();
}

/** What a graph means: all of it as the server exports it, but where its cards lie. */
export async function meaningOf(product: Product, id: string): Promise<object> {
  return JSON.parse(
    JSON.stringify(await umrfOf(product, id), (key, value: unknown) =>
      key === "gui_attributes" ? undefined : value,
    ),
  );
}

/** What a file means, once it is read. */
export async function meant(product: Product, file: object): Promise<object> {
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    body: JSON.stringify(file),
    headers: { "content-type": "application/json" },
  });
  return meaningOf(product, id);
}

export const CARD = ".react-flow__node-action";

export const chosen = (page: Page) => page.locator(`${CARD}.selected`);

/** Selects actions, and nothing else. */
export async function pick(page: Page, ...names: readonly [string, number][]): Promise<void> {
  await page.keyboard.press("Escape");
  for (const [i, [name, instance]] of names.entries()) {
    await card(page, name, instance).click({
      position: { x: 60, y: 12 },
      modifiers: i > 0 ? ["Shift"] : [],
    });
  }
  await expect(chosen(page)).toHaveCount(names.length);
}
