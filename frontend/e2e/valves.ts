/** A graph of three actions that people change and run, and what tests of its past need. */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { expect, type Page } from "@playwright/test";
import type { AxeResults } from "axe-core";
import { boxOf, card, saved } from "./canvas";
import type { Product } from "./product";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

const named = (name: string) => ({ name, instance_id: 0 });
const after = (name: string) => ({
  ...named(name),
  conditions: [
    "on_true -> run",
    "on_false -> ignore",
    "on_error -> ignore",
    "on_stopped -> ignore",
  ],
});
const at = (x: number, y: number) => ({ gui_attributes: { position: { x, y } } });
const speed = { speed: { pvf_type: "number", pvf_value: 0.4 } };
export const VALVES = {
  graph_name: "valves",
  graph_entry: [named("Drive")],
  graph_exit: [after("Report")],
  gui_attributes: { action_assistant: { direction: "right" } },
  actions: [
    {
      ...named("Drive"),
      type: "sync",
      ...at(140, 120),
      input_parameters: speed,
      children: [named("Cool")],
    },
    {
      ...named("Cool"),
      type: "sync",
      ...at(440, 120),
      parents: [after("Drive")],
      children: [named("Report")],
    },
    { ...named("Report"), type: "sync", ...at(740, 120), parents: [after("Cool")] },
  ],
};

export function post<T>(
  product: Product,
  path: string,
  body: object,
  base = product.url,
): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method: "POST", body: JSON.stringify(body), headers }, base);
}

interface Ran {
  id: string;
  number: number;
  state: string;
}

/** Runs the graph as it is now in the simulator, to its end. */
export async function ran(product: Product, graph: string): Promise<Ran> {
  const run = await begun(product, graph, 0.1);
  const now = () => product.ask<Ran>(`/api/runs/${run.id}`, {}, product.runnerUrl);
  const over = async () => ["finished", "halted", "error"].includes((await now()).state);
  await expect.poll(over, { timeout: 20_000 }).toBe(true);
  return now();
}

/** Begins to run a graph as it is now, each action so many seconds; `as`: said to be of another graph. */
export async function begun(product: Product, graph: string, s: number, as = graph): Promise<Ran> {
  const path = `/api/graphs/${graph}/versions`;
  const { id, digest } = await post<{ id: string; digest: string }>(product, path, {});
  const { umrf } = await product.ask<{ umrf: unknown }>(`/api/versions/${id}`);
  const request_id = `e2e-${++asked}`;
  const head = { version: id, digest, graph: as, engine: "simulator", request_id };
  const script = { behaviours: { "*": [{ after_s: s }] } };
  return post<Ran>(product, "/api/runs", { ...head, script, umrf }, product.runnerUrl);
}

let asked = 0;

/** Chooses an action; the view may be elsewhere, since it follows runs. */
export async function choose(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await boxOf(card(page, name));
  await card(page, name).click({ position: { x: 50, y: 20 } });
}

export async function setSpeed(page: Page, value: string): Promise<void> {
  await choose(page, "Drive");
  const field = page.getByRole("textbox", { name: /^speed/ });
  await field.fill(value);
  await field.press("Enter");
  await saved(page);
  await page.keyboard.press("Escape");
  await page.keyboard.press("Escape");
}

/** What axe says of the page, by the rules of WCAG. */
export async function violations(page: Page): Promise<string[]> {
  await page.evaluate(AXE);
  const found = await page.evaluate(
    () =>
      Reflect.get(window, "axe").run(document, {
        runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"],
        // Faces of people show initials and are named in full.
        rules: { "label-content-name-mismatch": { enabled: false } },
      }) as Promise<AxeResults>,
  );
  return found.violations.map(({ id, nodes }) => `${id}: ${nodes[0]?.html}`);
}
