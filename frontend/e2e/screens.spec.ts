/** Every page for people to look at, taken by `make screens`: both themes, each width, any names and sizes. */

import { mkdirSync } from "node:fs";
import { resolve } from "node:path";
import { type Browser, expect, type Page, test } from "@playwright/test";
import { atRest, CARD, saved } from "./canvas";
import { type Person, Product } from "./product";

test.skip(process.env.SCREENS !== "1", "takes pictures to be looked at: make screens");
test.use({ trace: "off", screenshot: "off" });
// With a worker for each, one slow size keeps no other waiting.
test.describe.configure({ timeout: 900_000, mode: "parallel" });

const FOLDER = resolve(process.env.SCREENS_TO ?? resolve(import.meta.dirname, "../screens"));
const SIZES = [5, 25, 60, 300, 1_000];
const LONG = "a_name_that_somebody_wrote_out_in_full_so_that_nobody_has_to_ask_what_it_does";
const RIGHT_TO_LEFT = "בדיקת־שסתום עם שם ארוך";
const product = new Product();

test.beforeAll(async () => {
  mkdirSync(FOLDER, { recursive: true });
  await product.start();
});
test.afterAll(() => product.dispose());

/** The widths of the matrix, and what is left of a laptop at 200 %. */
const WIDTHS = [
  { width: 1440, height: 900 },
  { width: 1280, height: 720 },
  { width: 834, height: 1194 },
  { width: 390, height: 844 },
] as const;
const ZOOMED = { width: 720, height: 450 } as const;
/** Narrower screens are touched. */
const TOUCH = 1_000;
const PHONE = 700;

const PAGES = [
  ...["", "runs", "runs/statistics", "runs/compare", "runs/queue", "runs/repeats", "robots"],
  ...["actions", "people", "programs", "audit", "admin", "nowhere", "help/"],
];

const NAMES = ["DriveTo", "IsValveClosed", "CloseValve", "SendReport", "PickUp", "WaitForDoor"];
const POSTED = { method: "POST", headers: { "content-type": "application/json" } };
const SAYS = ["on_true -> run", "on_false -> run", "on_error -> stop", "on_stopped -> ignore"];

async function make(
  name: string,
  actions: readonly string[],
  robots: readonly string[] = ["rover", "arm", ""],
): Promise<string> {
  const named = (i: number) => ({ name: actions[i] ?? "", instance_id: i });
  const last = actions.length - 1;
  const to = (i: number) => (i >= 0 && i <= last ? [named(i)] : []);
  const graph = {
    graph_name: name,
    graph_entry: to(0),
    graph_exit: to(last),
    actions: actions.map((_, i) => ({
      ...named(i),
      type: "sync",
      actor: robots[i % robots.length] ?? "",
      input_parameters: { place: { pvf_type: "string", pvf_value: name } },
      parents: to(i - 1).map((parent) => ({ ...parent, conditions: SAYS })),
      children: to(i + 1),
    })),
  };
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    body: JSON.stringify(graph),
    headers: { "content-type": "application/json" },
  });
  return id;
}

/** What a page shows once it has come to rest. */
async function taken(page: Page, name: string): Promise<void> {
  await atRest(page);
  await page.screenshot({ path: resolve(FOLDER, `${name}.png`) });
}

async function editor(page: Page, id: string): Promise<void> {
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
}

/** Both themes of what a page shows. */
async function bothThemes(page: Page, name: string): Promise<void> {
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    await taken(page, `${name}-${colorScheme}`);
  }
}

async function visitor(
  browser: Browser,
  viewport: { width: number; height: number },
): Promise<Person> {
  const touch = viewport.width < TOUCH && viewport !== ZOOMED;
  const device = viewport === ZOOMED ? { deviceScaleFactor: 2 } : {};
  const fingers = touch ? { hasTouch: true, isMobile: true } : {};
  return product.person(browser, "Ada", { viewport, ...device, ...fingers, panels: "folded" });
}

/** Two runs of the example in the simulator, of which the second takes another way. */
async function twoRuns(graph: string): Promise<[string, string]> {
  const made = await product.ask<{ id: string; digest: string }>(`/api/graphs/${graph}/versions`, {
    ...POSTED,
    body: "{}",
  });
  const { umrf } = await product.ask<{ umrf: object }>(`/api/versions/${made.id}`);
  const ran = async (behaviours: object) => {
    const what = { version: made.id, digest: made.digest, graph, engine: "simulator" };
    const how = { request_id: `${Math.random()}`, script: { behaviours } };
    const body = JSON.stringify({ ...what, ...how, umrf: JSON.stringify(umrf) });
    const { id } = await product.ask<{ id: string }>(
      "/api/runs",
      { ...POSTED, body },
      product.runnerUrl,
    );
    const state = async () =>
      (await product.ask<{ state: string }>(`/api/runs/${id}`, {}, product.runnerUrl)).state;
    await expect.poll(state).toBe("finished");
    return id;
  };
  const quick = { after_s: 0.2 };
  const other = [{ ...quick, result: "on_false" }, quick];
  return [await ran({ "*": [quick] }), await ran({ "*": [quick], IsValveClosed: other })];
}

test("every page, at each width and theme", async ({ browser }) => {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  const example = graphs.find((graph) => graph.name === "valve_inspection")?.id ?? "";
  const odd = [
    ["example", example],
    ["long", await make(LONG, [LONG, `${LONG}_too`, "Short"])],
    ["rtl", await make(RIGHT_TO_LEFT, [RIGHT_TO_LEFT, "נסיעה", "Short"])],
  ] as const;
  const [a, b] = await twoRuns(example);
  const pages = [
    ...PAGES.map((path) => [path.replace("/", "-") || "graphs", path] as const),
    ["run", `runs/${b}`],
    ["compared", `runs/compare?a=${a}&b=${b}`],
    ["counted", `runs/statistics?graph=${example}`],
  ] as const;
  for (const viewport of [...WIDTHS, ZOOMED]) {
    const { page, context } = await visitor(browser, viewport);
    for (const [name, path] of pages) {
      await page.goto(`${product.url}/${path}`);
      await page.waitForLoadState("networkidle");
      await bothThemes(page, `page-${name}-${viewport.width}`);
    }
    for (const [name, id] of odd) {
      await editor(page, id);
      await bothThemes(page, `editor-${name}-${viewport.width}`);
    }
    await context.close();
  }
});

/** A graph of that many actions in a row, each fourth of which has a second way to the one after the next. */
async function sized(count: number): Promise<string> {
  const named = (i: number) => ({ name: NAMES[i % NAMES.length] ?? "", instance_id: i });
  const after = (i: number) => [i + 1, ...(i % 4 === 1 ? [i + 2] : [])].filter((to) => to < count);
  const before = (i: number) =>
    [i - 2, i - 1].filter((from) => from >= 0 && after(from).includes(i));
  const graph = {
    graph_name: `size_${count}`,
    graph_entry: [named(0)],
    graph_exit: [named(count - 1)],
    actions: Array.from({ length: count }, (_, i) => ({
      ...named(i),
      type: "sync",
      parents: before(i).map((from) => ({ ...named(from), conditions: SAYS })),
      children: after(i).map(named),
    })),
  };
  const body = JSON.stringify(graph);
  return (await product.ask<{ id: string }>("/api/graphs", { ...POSTED, body })).id;
}

for (const size of SIZES) {
  test(`the editor and a run of ${size} actions, at each width and theme`, async ({ browser }) => {
    const id = await sized(size);
    for (const viewport of WIDTHS) {
      const { page, context } = await visitor(browser, viewport);
      const both = (state: string) => bothThemes(page, `size-${size}-${viewport.width}-${state}`);
      await editor(page, id);
      if (viewport.width < PHONE) {
        await both("outline");
        await page.getByRole("radiogroup").getByText("Canvas", { exact: true }).tap();
      }
      await expect(page.getByText(/^Arranging/)).toBeHidden({ timeout: 120_000 });
      await both("editor");
      await page.getByRole("button", { name: /^Run v\d+/ }).click();
      // A moment of the run at which something has ended and something goes on.
      await expect(page.locator(`${CARD} [data-tone="true"]`).first()).toBeVisible();
      await both("run");
      await page.getByRole("button", { name: /^Stop/ }).first().click();
      await expect(page.getByText("nothing runs").filter({ visible: true }).first()).toBeVisible();
      await context.close();
    }
  });
}
