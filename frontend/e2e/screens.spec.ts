/** Every page for people to look at, taken by `make screens`: both themes, three screens, any names. */

import { mkdirSync } from "node:fs";
import { resolve } from "node:path";
import { type Browser, expect, type Page, test } from "@playwright/test";
import { atRest, CARD, saved, start } from "./canvas";
import { Product } from "./product";

test.skip(process.env.SCREENS !== "1", "takes pictures to be looked at: make screens");
test.use({ trace: "off", screenshot: "off" });
test.describe.configure({ timeout: 600_000 });

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

const SCREENS = {
  light: { viewport: { width: 1440, height: 900 }, colorScheme: "light" },
  dark: { viewport: { width: 1440, height: 900 }, colorScheme: "dark" },
  tablet: { viewport: { width: 820, height: 1180 }, hasTouch: true, isMobile: true },
  phone: { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true },
  // What is left of a laptop at 200 %.
  zoomed: { viewport: { width: 720, height: 450 }, deviceScaleFactor: 2 },
} as const satisfies Record<string, Parameters<Browser["newContext"]>[0]>;

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

async function panes(page: Page, name: string): Promise<void> {
  for (const pane of ["Outline", "Details", "Run"]) {
    await page.getByRole("radiogroup").getByText(pane, { exact: true }).tap();
    await taken(page, `${name}-${pane.toLowerCase()}`);
  }
}

for (const [name, options] of Object.entries(SCREENS)) {
  test(`every page, ${name}`, async ({ browser }) => {
    const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
    const example = graphs.find((graph) => graph.name === "valve_inspection")?.id ?? "";
    const odd = [
      ["long", await make(LONG, [LONG, `${LONG}_too`, "Short"])],
      ["rtl", await make(RIGHT_TO_LEFT, [RIGHT_TO_LEFT, "נסיעה", "Short"])],
    ] as const;
    const { page, context } = await product.person(browser, "Ada", {
      ...options,
      panels: "folded",
    });
    await taken(page, `${name}-graphs`);
    for (const path of [
      "runs",
      "runs/statistics",
      "runs/compare",
      "robots",
      "actions",
      "nowhere",
    ]) {
      await page.goto(`${product.url}/${path}`);
      await taken(page, `${name}-${path.replace("/", "-")}`);
    }
    for (const [which, id] of [["editor", example], ...odd] as const) {
      await editor(page, id);
      await taken(page, `${name}-${which}`);
      if (name === "phone") await panes(page, `${name}-${which}`);
    }
    await context.close();
  });
}

test("graphs of every size", async ({ browser }) => {
  const { page, context } = await product.person(browser, "Ada", {
    ...SCREENS.light,
    panels: "folded",
  });
  for (const size of SIZES) {
    await editor(page, await make(`size_${size}`, Array(size).fill("Step"), ["rover"]));
    await page.getByRole("button", { name: "Fit", exact: true }).click();
    await expect(page.getByText(/^Arranging/)).toBeHidden({ timeout: 120_000 });
    await taken(page, `size-${size}`);
    await page.emulateMedia({ colorScheme: "dark" });
    await taken(page, `size-${size}-dark`);
    await page.emulateMedia({ colorScheme: "light" });
    if (size > 300) continue;
    // Where it runs and what has ended, at one glance.
    await start(page);
    await expect(page.getByText("running", { exact: true }).first()).toBeVisible();
    await expect(page.locator(`${CARD} [data-tone="true"]`).first()).toBeVisible();
    await page.getByRole("button", { name: "Fit", exact: true }).click();
    await taken(page, `size-${size}-runs`);
    await page.getByRole("button", { name: /^Stop run/ }).click();
  }
  await context.close();
});
