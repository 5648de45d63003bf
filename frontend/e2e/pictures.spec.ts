/** The pictures in docs/pictures, taken by `make pictures` from the running product. */

import { resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { atRest, card, fitView, holdEnter, saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { Product } from "./product";

test.skip(process.env.PICTURES !== "1", "takes pictures for the documentation: make pictures");

const FOLDER = resolve(
  process.env.PICTURES_TO ?? resolve(import.meta.dirname, "../../docs/pictures"),
);
const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

async function picture(page: Page, name: string): Promise<void> {
  await atRest(page);
  await page.screenshot({ path: resolve(FOLDER, `${name}.png`) });
}

/** Shows everything. */
async function whole(page: Page): Promise<void> {
  const exit = page.locator(".react-flow__node").filter({ has: page.getByLabel("End with") });
  const tools = page.getByRole("toolbar", { name: "Canvas tools" });
  const hidden = async () => {
    const [end, over] = [await exit.boundingBox(), await tools.boundingBox()];
    return end === null || over === null || end.y + end.height > over.y;
  };
  for (let i = 0; i < 3 && (i === 0 || (await hidden())); i += 1) {
    await fitView(page);
  }
  await page.mouse.move(720, 880);
}

async function graph(name: string): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  const found = graphs.find((each) => each.name === name);
  if (found === undefined) throw new Error(`no example ${name}`);
  return `${product.url}/graphs/${found.id}`;
}

/** The same graph with robots, so that they can be told apart. Answers its id. */
async function withRobots(name: string, as: string, robots: string[]): Promise<string> {
  const id = (await graph(name)).split("/").at(-1);
  const file = await product.ask<{ graph_name: string; actions: Record<string, unknown>[] }>(
    `/api/graphs/${id}/umrf`,
  );
  const body = JSON.stringify({
    ...file,
    graph_name: as,
    gui_attributes: { labels: ["night shift"] },
    actions: file.actions.map((action, i) => ({ ...action, actor: robots[i % robots.length] })),
  });
  const headers = { "content-type": "application/json" };
  const made = await product.ask<{ id: string }>("/api/graphs", { method: "POST", body, headers });
  return made.id;
}

/** This person starts a graph in the simulator, with actions that do as they are told. */
async function begun(
  page: Page,
  graph: string,
  behaviours: Record<string, object[]>,
): Promise<string> {
  const headers = { "content-type": "application/json" };
  const version = await product.ask<{ id: string; digest: string }>(
    `/api/graphs/${graph}/versions`,
    { method: "POST", body: "{}", headers },
  );
  const { umrf } = await product.ask<{ umrf: unknown }>(`/api/versions/${version.id}`);
  const answer = await page.request.post(`${product.runnerUrl}/api/runs`, {
    headers: { origin: product.url },
    data: {
      version: version.id,
      digest: version.digest,
      graph,
      engine: "simulator",
      request_id: `picture-${Math.random()}`,
      script: { behaviours },
      umrf,
    },
  });
  expect(answer.ok(), await answer.text()).toBe(true);
  return ((await answer.json()) as { id: string }).id;
}

async function ended(run: string): Promise<void> {
  const now = () => product.ask<{ state: string }>(`/api/runs/${run}`, {}, product.runnerUrl);
  await expect
    .poll(async () => (await now()).state, { timeout: 40_000 })
    .toMatch(/finished|error|stopped/);
}

test("why a run failed", async ({ browser }) => {
  const options = { viewport: { width: 1440, height: 900 } };
  const { page, context } = await product.person(browser, "Ada", options);
  await page.goto(`${product.url}/runs`);
  await page.getByRole("button", { name: "Show five recorded runs that failed" }).click();
  await page.getByRole("link", { name: /photo_round/ }).click();
  const why = page.getByRole("region", { name: "Why" });
  await expect(why.getByRole("listitem").first()).toContainText("Ben pressed Stop while Look ran");
  await why.getByRole("button").first().click();
  await picture(page, "why-light");
  await context.close();
});

const SLOW = { after_s: 100 };
const BRISK = { after_s: 0.6 };

for (const scheme of ["light", "dark"] as const) {
  test(`desktop, ${scheme}`, async ({ browser }) => {
    const viewport = { width: 1440, height: 900 };
    const options = { colorScheme: scheme, viewport, panels: "folded" } as const;
    const { page, context } = await product.person(browser, "Ada", options);
    const mari = await product.person(browser, "Mari", options);
    const id = await withRobots("prepare_delivery", `delivery_${scheme}`, ["rover"]);
    await page.goto(`${product.url}/graphs/${id}`);
    await mari.page.goto(`${product.url}/graphs/${id}`);
    await saved(page);
    await card(mari.page, "WaitForParcel").click({ position: { x: 50, y: 30 } });
    // Under way for as long as the picture takes.
    const run = await begun(page, id, { "*": [BRISK], DriveTo_0: [SLOW] });
    await expect(card(page, "DriveTo").getByText("running")).toBeVisible({ timeout: 20_000 });
    await card(page, "DriveTo").click({ position: { x: 50, y: 30 } });
    await whole(page); // beside the details
    await picture(page, `editor-${scheme}`);
    await page.getByRole("button", { name: /^Stop run/ }).click();
    await ended(run);
    await page.goto(product.url);
    await expect(page.getByRole("heading", { name: `delivery_${scheme}` })).toBeVisible();
    await picture(page, `graphs-${scheme}`);
    await context.close();
    await mari.context.close();
  });
}

test("a dry-run", async ({ browser }) => {
  const options = { viewport: { width: 1440, height: 900 }, panels: "folded" } as const;
  const { page, context } = await product.person(browser, "Ada", options);
  await page.goto(await graph("valve_inspection"));
  await saved(page);
  await page.getByRole("button", { name: "Dry-run" }).click();
  const bar = page.getByRole("region", { name: "Dry-run" });
  await expect(bar).toContainText("runs");
  await bar.getByRole("button", { name: "Next moment" }).click();
  await bar.getByRole("button", { name: /^error/ }).click();
  await expect(bar).toContainText("ends with an error");
  await whole(page);
  await picture(page, "dry-run-light");
  await context.close();
});

test("what was, and what was otherwise", async ({ browser }) => {
  test.setTimeout(180_000);
  const id = await withRobots("valve_inspection", "evening_inspection", ["rover"]);
  const jammed = { after_s: 0.9, result: "on_error", message: "camera sees nothing but steam" };
  const people = [await product.person(browser, "Ada"), await product.person(browser, "Mari")];
  const steps = [{ "*": [BRISK] }, { "*": [{ after_s: 0.4 }] }, { "*": [{ after_s: 0.8 }] }];
  for (const [i, step] of steps.entries()) {
    const by = people[i % 2];
    if (by) await ended(await begun(by.page, id, step));
  }
  const [ada] = people;
  if (!ada) throw new Error("nobody is there");
  const bad = await begun(ada.page, id, { "*": [BRISK], IsValveClosed_0: [jammed] });
  await ended(bad);
  for (const each of people) await each.context.close();
  for (const scheme of ["light", "dark"] as const) {
    const options = { colorScheme: scheme, viewport: { width: 1440, height: 900 } };
    const { page, context } = await product.person(browser, "Ada", options);
    await page.goto(`${product.url}/runs/${bad}`);
    await expect(card(page, "IsValveClosed").getByText("error")).toBeVisible();
    await picture(page, `run-${scheme}`);
    await page.goto(`${product.url}/runs`);
    await picture(page, `runs-${scheme}`);
    if (scheme === "light") {
      for (const run of await page.getByLabel(/^Choose run \d+ to compare/).all()) {
        if ((await page.locator("input:checked[aria-label^=Choose]").count()) < 2)
          await run.check();
      }
      await page.getByRole("button", { name: "Compare the two" }).click();
      await expect(page.getByText("here they part").first()).toBeVisible();
      await picture(page, "compare-light");
      await page.goto(`${product.url}/runs?graph=${id}`);
      await page.getByRole("link", { name: "Statistics", exact: true }).click();
      await expect(page.getByText(/of \d+ runs finished true/)).toBeVisible();
      await picture(page, "statistics-light");
    }
    await context.close();
  }
});

for (const scheme of ["light", "dark"] as const) {
  test(`what a graph says, ${scheme}`, async ({ browser }) => {
    const options = { colorScheme: scheme, viewport: { width: 1440, height: 900 } };
    const { page, context } = await product.person(browser, "Ada", options);
    const id = await withRobots("fetch_tool", `night_round_${scheme}`, ["rover", "rover", "arm"]);
    await page.goto(`${product.url}/graphs/${id}`);
    await saved(page);
    const first = page.locator(".react-flow__node-action").first();
    await first.click({ position: { x: 50, y: 30 } });
    await page.keyboard.press("m");
    const say = page.getByRole("textbox", { name: /^Comment on/ });
    await say.fill("Slower in the aisle, people walk here at night.");
    await say.press("ControlOrMeta+Enter");
    await expect(page.getByRole("button", { name: "Resolve" })).toBeVisible();
    await page.getByRole("radiogroup").getByText("Outline", { exact: true }).click();
    await whole(page);
    await picture(page, `outline-${scheme}`);
    await page.getByRole("tab", { name: "JSON" }).click();
    await expect(page.getByRole("textbox", { name: "JSON of the graph" })).toBeVisible();
    await page.getByRole("button", { name: /^arm/ }).last().click();
    await picture(page, `json-${scheme}`);
    await context.close();
  });
}

for (const [name, width, height] of [
  ["tablet", 768, 1024],
  ["phone", 390, 844],
] as const) {
  test(`on a ${name}`, async ({ browser }) => {
    const options = { viewport: { width, height }, hasTouch: true, isMobile: true };
    const { page, context } = await product.person(browser, "Ada", options);
    await page.goto(await graph("valve_inspection"));
    await saved(page);
    await picture(page, `editor-${name}`);
    if (name === "phone") {
      await page.getByRole("radiogroup").getByText("Outline", { exact: true }).tap();
      await picture(page, "outline-phone");
    }
    await context.close();
  });
}

test.describe("robots", () => {
  test.skip(NO_ROS !== "", NO_ROS);
  const david = new StandIn("David");
  const carol = new StandIn("Carol");

  test.beforeAll(async () => {
    for (const robot of [david, carol])
      robot.start(product.data, { "*": { after_s: 20, stop_s: 0.05 } });
    for (const { name, path } of [david, carol, new StandIn("Rover")]) {
      await product.ask(
        "/api/robots",
        {
          method: "POST",
          body: JSON.stringify({ name, domain: DOMAIN, get_service: path }),
          headers: { "content-type": "application/json" },
        },
        product.runnerUrl,
      );
    }
  });
  test.afterAll(() => Promise.all([david.end(), carol.kill()]));

  async function chosen(page: Page, url: string, robots: string[]): Promise<void> {
    await page.goto(url);
    await saved(page);
    const phone = page.getByRole("radiogroup").getByText("Run", { exact: true });
    if (await phone.isVisible()) await phone.tap();
    await page.getByRole("button", { name: "Choose where to start" }).click();
    for (const robot of robots) {
      await page.getByRole("checkbox", { name: new RegExp(`^${robot}`) }).check();
    }
    await expect(page.getByText(/David answered after/)).toBeVisible({ timeout: 45_000 });
  }

  for (const scheme of ["light", "dark"] as const) {
    test(`are watched and looked at, ${scheme}`, async ({ browser }) => {
      const options = { colorScheme: scheme, viewport: { width: 1440, height: 900 } };
      const { page, context } = await product.person(browser, "Ada", options);
      const url = `${product.url}/graphs/${await product.chain(3)}`;
      await page.goto(`${product.url}/robots`);
      await expect(page.getByText("answers", { exact: true })).toHaveCount(2, { timeout: 40_000 });
      await chosen(page, url, ["David", "Rover"]);
      await picture(page, `start-${scheme}`);
      await page.getByRole("checkbox", { name: /^Rover/ }).uncheck();
      const begin = page.getByRole("button", { name: /^Start v\d+ on David/ });
      await expect(begin).toBeEnabled();
      await holdEnter(page, begin);
      await expect(page.getByText(/proof \d/)).toBeVisible();
      await page.goto(`${product.url}/robots`);
      await page.getByRole("tab", { name: "What others told it" }).first().click();
      await picture(page, `robots-${scheme}`);
      await page.keyboard.press("Control+.");
      await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
      await context.close();
    });
  }

  test("on a phone, and one that falls silent", async ({ browser }) => {
    const options = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
    const { page, context } = await product.person(browser, "Ada", options);
    await page.goto(`${product.url}/robots`);
    await picture(page, "robots-phone");
    await chosen(page, `${product.url}/graphs/${await product.chain(3)}`, ["David", "Carol"]);
    await picture(page, "start-phone");
    await page.getByRole("checkbox", { name: /^David/ }).uncheck();
    const begin = page.getByRole("button", { name: /^Start v\d+ on Carol/ });
    await expect(begin).toBeEnabled();
    await holdEnter(page, begin);
    await expect(page.getByRole("button", { name: /^Stop run/ })).toBeVisible();
    carol.freeze();
    await page.getByRole("button", { name: /^Stop run/ }).tap();
    await expect(page.getByRole("alert")).toContainText("STOP UNCONFIRMED");
    await expect(page.getByRole("alert").getByRole("button", { name: /^I looked/ })).toBeVisible();
    await picture(page, "stop-unconfirmed-phone");
    await context.close();
  });
});
