/** STOP is in sight on each page, at each width, whatever goes on; and it outlives the page around it. */

import { expect, type Page, test } from "@playwright/test";
import { atRest, boxOf, saved } from "./canvas";
import { LONG, Product } from "./product";
import { post } from "./valves";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
/** All of them where a test may take long; else those at which the page is laid out otherwise. */
const WIDTHS = LONG === "" ? [320, 360, 390, 412, 600, 1440] : [320, 390, 600, 1440];
const OTHER_WIDTHS = LONG === "" ? WIDTHS : [320];
const COMPONENTS = LONG === "" ? [0, 1, 2, 4, 8, 16] : [0, 8];

interface Run {
  id: string;
  state: string;
}

/** The newest run; right after a start there may be none yet. */
const newest = async (): Promise<Run | undefined> =>
  (await product.ask<Run[]>("/api/runs?limit=1", {}, product.runnerUrl))[0];
const stateIs = (state: string) => expect.poll(async () => (await newest())?.state).toBe(state);
const stopOf = (page: Page) => page.getByRole("button", { name: /^Stop / });

/** A run that goes on until it is stopped, seen by the page of its graph. */
async function running(page: Page, graph: string): Promise<string> {
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  const version = await post<{ id: string; digest: string; umrf: object }>(
    product,
    `/api/graphs/${graph}/versions`,
    {},
  );
  const { id, digest, umrf } = version;
  const order = { version: id, digest, umrf, graph, engine: "simulator" };
  const script = { behaviours: { Wait_5: [{ never: true }] } };
  const body = { ...order, script, request_id: crypto.randomUUID() };
  const run = await post<Run>(product, "/api/runs", body, product.runnerUrl);
  await stateIs("running");
  return run.id;
}

/** Go to another address in place, as links do. */
async function go(page: Page, route: string): Promise<void> {
  await page.evaluate((to) => history.pushState(null, "", to), route);
  await expect(page.locator("main").first()).toBeVisible();
}

/** Pictures of a run that goes on, to be looked at. */
async function pictures(page: Page, folder: string, run: string): Promise<void> {
  await go(page, `/runs/${run}`);
  for (const colorScheme of ["light", "dark"] as const) {
    await page.emulateMedia({ colorScheme });
    for (const width of [320, 390, 1440]) {
      await page.setViewportSize({ width, height: 844 });
      await page.screenshot({ path: `${folder}/run-${width}-${colorScheme}.png` });
    }
  }
  await page.setViewportSize(PHONE.viewport);
}

/** Return what is wrong with STOP or the width of the page; "" where a finger finds STOP, whole. */
function trouble(page: Page): Promise<string> {
  return page.evaluate(async () => {
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
    const stop = [...document.querySelectorAll<HTMLButtonElement>("button")].find((button) =>
      /^Stop .*Software stop/.test(button.textContent ?? ""),
    );
    if (stop === undefined) return "there is none";
    const { left, right, top, bottom } = stop.getBoundingClientRect();
    const { offsetLeft, offsetTop, width, height } = visualViewport as VisualViewport;
    const box = [left, top, right, bottom].map(Math.round).join(" ");
    const seen = [offsetLeft, offsetTop, offsetLeft + width, offsetTop + height];
    const [l = 0, t = 0, r = 0, b = 0] = seen;
    if (left < l - 0.5 || top < t - 0.5 || right > r + 0.5 || bottom > b + 0.5) {
      return `${box} is not inside ${seen.map(Math.round).join(" ")}`;
    }
    const at = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
    if (!stop.contains(at)) return `under ${at?.outerHTML.slice(0, 80)}`;
    const wide = document.documentElement.scrollWidth;
    return wide > screen.width + 1 ? `the page is ${wide} px wide` : "";
  });
}

async function inSight(
  page: Page,
  routes: readonly string[],
  what: string,
  widths: readonly number[] = WIDTHS,
): Promise<void> {
  const troubles: string[] = [];
  for (const route of routes) {
    await go(page, route);
    for (const width of widths) {
      await page.setViewportSize({ width, height: 844 });
      const found = await trouble(page);
      if (found !== "") troubles.push(`${what} ${route} ${width} px: ${found}`);
    }
  }
  expect(troubles).toEqual([]);
}

/** A dialog that fills a phone leaves room for what is said of Stop. */
async function noticeOverDialog(page: Page): Promise<void> {
  await page.setViewportSize(PHONE.viewport);
  await page.getByRole("button", { name: /^You are / }).tap();
  await page.getByRole("button", { name: "Share with others …" }).tap();
  const dialog = page.getByRole("dialog", { name: "Share" });
  // Messages of the graph that is still being arranged are alerts, too.
  const notice = page.getByRole("region", { name: "Stop" }).getByRole("alert");
  await expect(notice).toContainText("STOP MAY REACH NOBODY");
  const over = async () => {
    const [box, said] = [await dialog.boundingBox(), await notice.boundingBox()];
    if (box === null || said === null) return "not drawn";
    const [x, y] = [said.x + said.width / 2, said.y + said.height / 2];
    const inNotice = ([left, top]: number[]) =>
      document.elementFromPoint(left ?? 0, top ?? 0)?.closest("[role=alert]") !== null;
    if (!(await page.evaluate(inNotice, [x, y]))) return "the notice is covered";
    return box.y + box.height > said.y ? "the notice covers the dialog" : "";
  };
  await expect.poll(over).toBe("");
  await dialog.getByRole("button", { name: "Close" }).tap();
}

test("STOP is inside the screen and under nothing: each page, each width, idle, running, unknown", async ({
  browser,
}) => {
  test.slow();
  const { page, context, failures } = await product.person(browser, "Ada Lovelace", PHONE);
  const graph = await product.chain(60);
  const run = await running(page, graph);
  const routes = [
    `/runs/${run}`,
    "/",
    `/graphs/${graph}`,
    "/actions",
    "/robots",
    "/admin",
    "/runs",
  ];
  routes.push(`/runs/compare?a=${run}&b=${run}`, "/runs/statistics", "/nowhere");
  await inSight(page, routes, "running");
  await page.setViewportSize(PHONE.viewport);
  if (process.env.STOP_PICTURES) await pictures(page, process.env.STOP_PICTURES, run);

  const runner = product.pid("runner");
  process.kill(runner, "SIGSTOP");
  try {
    await expect(stopOf(page)).toContainText("state unknown");
    await inSight(page, routes, "unknown", OTHER_WIDTHS);
    await noticeOverDialog(page);
  } finally {
    process.kill(runner, "SIGCONT");
  }
  await page.setViewportSize(PHONE.viewport);
  await expect(stopOf(page)).not.toContainText("state unknown");
  // Zoomed by two fingers it is as large as before, in what is seen.
  const zoom = await context.newCDPSession(page);
  await zoom.send("Emulation.setPageScaleFactor", { pageScaleFactor: 2 });
  await expect.poll(() => trouble(page)).toBe("");
  await stopOf(page).tap();
  await stateIs("stopped");
  await zoom.send("Emulation.setPageScaleFactor", { pageScaleFactor: 1 });
  await inSight(page, routes, "idle", OTHER_WIDTHS);
  expect(failures).toEqual([]);
  await context.close();
});

/** Where the parts of a page begin and end, and the controls that what is said of Stop lies on. */
function partsOf(page: Page): Promise<{ parts: string[]; under: string[] }> {
  return page.evaluate(() => {
    const boxOf = (each: Element) => each.getBoundingClientRect();
    const parts = document.querySelectorAll(
      "main, main h1, main aside, .react-flow, [role=toolbar]",
    );
    const said = document.querySelector("#stop [role=alert]");
    const over = (each: Element) => {
      const [a, b] = [boxOf(said ?? each), boxOf(each)];
      const apart =
        a.right <= b.left || a.left >= b.right || a.bottom <= b.top || a.top >= b.bottom;
      return said !== null && !apart;
    };
    const controls = document.querySelectorAll("main :is(button, input, a, h1)");
    return {
      parts: [...parts].map((each) => {
        const { x, y, right } = boxOf(each);
        return `${each.tagName} ${each.ariaLabel ?? ""} ${[x, y, right].map(Math.round)}`;
      }),
      under: [...controls]
        .filter((each) => each.checkVisibility() && each.closest(".react-flow") === null)
        .filter(over)
        .map((each) => each.ariaLabel ?? each.textContent ?? ""),
    };
  });
}

test("what is said of Stop moves nothing of a page, and lies on no control beside a canvas", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada", { panels: "folded" });
  const graph = await product.chain(3);
  const canvases = [`/graphs/${graph}`, `/runs/${await running(page, graph)}`];
  const seen = async () => {
    const found = new Map<string, Awaited<ReturnType<typeof partsOf>>>();
    for (const route of [...canvases, "/", "/runs", "/robots", "/actions"]) {
      await go(page, route);
      for (const width of [1440, 1200, 834]) {
        await page.setViewportSize({ width, height: 900 });
        await atRest(page);
        found.set(`${route} ${width}`, await partsOf(page));
      }
    }
    return found;
  };
  const before = await seen();
  const runner = product.pid("runner");
  process.kill(runner, "SIGSTOP");
  try {
    const said = page.getByRole("region", { name: "Stop" }).getByRole("alert");
    await expect(said).toContainText("STOP MAY REACH NOBODY");
    const after = await seen();
    await expect(said).toBeVisible();
    for (const [where, { parts, under }] of after) {
      expect(parts, where).toEqual(before.get(where)?.parts);
      if (canvases.some((route) => where.startsWith(route))) expect(under, where).toEqual([]);
    }
    // The search has the upper edge, and keeps it.
    await go(page, canvases[0] ?? "");
    await page.keyboard.press("Control+f");
    const search = page.getByRole("search", { name: "Find in graph" });
    const [bar, notice] = [await boxOf(search), await boxOf(said)];
    expect(notice.y).toBeGreaterThan(bar.y + bar.height);
    await page.keyboard.press("Escape");
    // So has a dialog, which leaves room below.
    await page.keyboard.press("Control+k");
    const dialog = page.getByRole("dialog");
    const [box, below] = [await boxOf(dialog), await boxOf(said)];
    expect(below.y).toBeGreaterThanOrEqual(box.y + box.height);
    await page.keyboard.press("Escape");
  } finally {
    process.kill(runner, "SIGCONT");
  }
  await page
    .getByRole("button", { name: /^Stop / })
    .first()
    .click();
  expect(failures).toEqual([]);
  await context.close();
});

/** Have the next drawing of the n-th component with a state throw, from the top; its name, "" after the last. */
function breakComponent(page: Page, n: number): Promise<string> {
  return page.evaluate((nth) => {
    interface Queue {
      dispatch?: ((change: () => never) => void) | null;
      lastRenderedReducer?: (state: unknown, change: () => string) => unknown;
    }
    interface Hook {
      queue: Queue | null;
      next: Hook | null;
    }
    interface Fiber {
      type: { name?: string } | null;
      memoizedState: Hook | null;
      child: Fiber | null;
      sibling: Fiber | null;
      tag: number;
    }
    const place = document.getElementById("root") as unknown as Record<string, Fiber>;
    const key = Object.keys(place).find((each) => each.startsWith("__reactContainer"));
    const found: [string, (change: () => never) => void][] = [];
    const wait: (Fiber | null)[] = [place[key ?? ""]?.child ?? null];
    for (let at = wait.shift(); at !== undefined; at = wait.shift()) {
      for (let fiber = at; fiber !== null; fiber = fiber.sibling) {
        wait.push(fiber.child);
        const isFunction = fiber.tag === 0 || fiber.tag === 11 || fiber.tag === 15;
        let hook = isFunction ? fiber.memoizedState : null;
        // A state that takes a function; others give it to a reducer of their own.
        const isState = ({ queue }: Hook) => queue?.lastRenderedReducer?.(0, () => "f") === "f";
        while (hook?.queue !== undefined && !isState(hook)) hook = hook.next;
        const dispatch = hook?.queue?.dispatch;
        if (dispatch) found.push([fiber.type?.name || "a component", dispatch]);
      }
    }
    const [name = "", dispatch] = found[nth] ?? [];
    dispatch?.(() => {
      throw new Error("made to throw");
    });
    return name;
  }, n);
}

test("whichever component throws, STOP stands and stops, and the page says what happened", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  const graph = await product.chain(60);
  let run = await running(page, graph);
  const broken = page.getByRole("alert").filter({ hasText: "This page broke" });
  for (const n of COMPONENTS) {
    await page.goto(`${product.url}/runs/${run}`);
    await expect(page.getByRole("region", { name: "Timeline" })).toBeVisible();
    const name = await breakComponent(page, n);
    expect(name, `there is no component ${n}`).not.toBe("");
    await expect(broken, name).toContainText("made to throw");
    await expect(broken.getByRole("button", { name: "Reload the page" })).toBeVisible();
    expect(await trouble(page)).toBe("");
  }
  await stopOf(page).click();
  await stateIs("stopped");
  await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
  await broken.getByRole("button", { name: "Reload the page" }).click();
  await expect(page.getByRole("region", { name: "Timeline" })).toBeVisible();

  // A part of the page that does not come, and one that is damaged.
  run = await running(page, graph);
  const parts = /\/assets\/(page|ui)-.*\.js/;
  await page.route(parts, (route) => route.abort());
  await page.goto(`${product.url}/runs/${run}`);
  await expect(broken).toContainText("did not load");
  await expect(stopOf(page)).toContainText("1 run");
  await page.unroute(parts);
  await page.route(parts, (route) => route.fulfill({ contentType: "text/javascript", body: "?" }));
  await page.goto(`${product.url}/runs/${run}`);
  await expect(broken).toBeVisible();
  await page.keyboard.press("Control+.");
  await stateIs("stopped");
  await context.close();
});

/** Do to all texts of the page what translators do. */
function translate(page: Page): Promise<number> {
  return page.evaluate(() => {
    const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    const texts: Text[] = [];
    while (walk.nextNode()) {
      const text = walk.currentNode as Text;
      if (text.data.trim() !== "" && text.parentElement?.tagName !== "SCRIPT") texts.push(text);
    }
    for (const [i, text] of texts.entries()) {
      const [outer, inner] = [document.createElement("font"), document.createElement("font")];
      outer.append(inner);
      if (i % 2 === 0) {
        inner.textContent = "übersetzt";
        text.replaceWith(outer);
      } else {
        text.before(outer);
        inner.append(text);
      }
    }
    return texts.length;
  });
}

test("what a translation or an extension does to the page makes nothing of it lie, and takes no STOP", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const graph = await product.chain(60);
  const run = await running(page, graph);
  expect(await page.locator("html").getAttribute("translate")).toBe("no");
  await page.goto(`${product.url}/runs/${run}`);
  await expect(page.getByRole("region", { name: "Timeline" })).toBeVisible();
  expect(await translate(page)).toBeGreaterThan(50);
  await expect(page.getByText("übersetzt")).toHaveCount(0);
  await expect(stopOf(page)).toContainText("1 run");
  await stopOf(page).click();
  await stateIs("stopped");
  await expect(page.getByRole("banner")).toContainText("stopped");
  await translate(page);
  await go(page, `/graphs/${graph}`);
  await expect(page.locator(".react-flow__node-action").first()).toBeVisible();

  // An extension takes away whatever it likes, STOP too.
  await go(page, `/runs/${run}`);
  await expect(page.getByRole("region", { name: "Timeline" })).toBeVisible();
  await page.evaluate(() => {
    for (const each of document.querySelectorAll("header *, main section > *, #stop *")) {
      if (each.childElementCount === 0) each.remove();
    }
  });
  await go(page, "/runs");
  await expect(page.getByRole("heading", { name: "Runs", level: 1 })).toBeVisible();
  await expect.poll(() => trouble(page)).toBe("");
  await page.evaluate(() => document.getElementById("stop")?.remove());
  await expect.poll(() => trouble(page)).toBe("");
  await go(page, "/robots");
  await expect(page.getByRole("heading", { name: /robot/i }).first()).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});
