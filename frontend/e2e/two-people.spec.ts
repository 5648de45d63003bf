/** Two people build a graph from nothing, run it, lose both processes in between, and lose nothing. */

import { expect, type Locator, test } from "@playwright/test";
import { add, card, connect, enter, give, move, saved, seenRunning, start, watch } from "./canvas";
import { type Person, Product } from "./product";

const product = new Product();
let ada: Person;
let mari: Person;

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada", { loadsAhead: true });
  mari = await product.person(browser, "Mari", { loadsAhead: true });
});

test.afterAll(() => product.dispose());

interface Umrf {
  graph_name: string;
  actions: { name: string; parents?: { name: string; conditions: string[] }[] }[];
}

async function umrf(id: string): Promise<Umrf> {
  return product.ask<Umrf>(`/api/graphs/${id}/umrf`);
}

test("two people build, run and review a graph; kill -9 loses nothing", async () => {
  test.setTimeout(180_000);
  const { page } = ada;
  await expect(page.getByText("search_aisles")).toBeVisible();
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1) as string;
  await mari.page.goto(page.url());

  // Ada draws the main line, Mari sees it as it comes.
  await add(page, "Look");
  await move(page, "Look", [0, 110], "entry");
  await expect(card(mari.page, "Look")).toBeVisible();
  await enter(page, "Look");
  await add(page, "Grip");
  await move(page, "Grip", [-170, 160], "Look");

  // Mari draws the branch; each sees the other's name.
  await add(mari.page, "Search");
  await move(mari.page, "Search", [170, 160], "Look");
  await expect(card(page, "Search")).toBeVisible();
  await connect(mari.page, "Look", "false", "Search");
  await connect(page, "Look", "true", "Grip");
  await expect(page.getByText("Also here: Mari")).toBeAttached();
  await expect(mari.page.getByText("Also here: Ada")).toBeAttached();
  await saved(page);
  await saved(mari.page);

  // Everything dies, and comes back.
  await product.kill();
  await expect(page.getByText(/server away/i).first()).toBeVisible();
  await add(page, "Report");
  await expect(page.getByText(/Server away with \d+ change/)).toBeVisible();
  await product.start();
  await saved(page);
  await expect(card(mari.page, "Report")).toBeVisible();
  // Whoever came back first has the first colour now.
  const color = (face: Locator) => face.evaluate((it) => getComputedStyle(it).backgroundColor);
  const faces = (of: Person, other: string) => [
    of.page.getByRole("button", { name: /^You are/ }).locator("[aria-hidden]"),
    of.page.getByRole("button", { name: `Follow ${other}` }),
  ];
  await expect(async () => {
    const [adas, maris] = await Promise.all(faces(ada, "Mari").map(color));
    expect(adas).not.toBe(maris);
    expect(await Promise.all(faces(mari, "Ada").map(color))).toEqual([maris, adas]);
  }).toPass();
  await move(page, "Report", [0, 320], "Look");
  // Only one of the two branches comes, so Report waits for neither, without a word from Ada.
  for (const branch of ["Grip", "Search"]) await connect(page, branch, "true", "Report");
  await expect(page.getByRole("switch", { name: /Report.* waits for this/ })).not.toBeChecked();
  await connect(page, "Report", "true", "exit");

  // Mari gives a parameter to Grip; Ada sees its value on the card.
  await give(mari.page, "Grip", "force", "12 N");
  await expect(card(page, "Grip").getByText("12 N", { exact: true })).toBeVisible();
  await saved(page);
  await saved(mari.page);

  const drawn = await umrf(id);
  expect(drawn.actions.map((action) => action.name).sort()).toEqual([
    "Grip",
    "Look",
    "Report",
    "Search",
  ]);
  const conditions = (name: string) =>
    drawn.actions.find((action) => action.name === name)?.parents?.[0]?.conditions;
  expect(conditions("Grip")).toEqual([
    "on_true -> run",
    "on_false -> ignore",
    "on_error -> ignore",
    "on_stopped -> ignore",
  ]);
  expect(conditions("Search")?.slice(0, 2)).toEqual(["on_true -> ignore", "on_false -> run"]);

  // Ada starts; both watch it, to the end.
  const both = [page, mari.page];
  await Promise.all(both.map(watch));
  await start(page);
  for (const each of both) {
    await expect(card(each, "Report")).toContainText(/true\s*· \d/);
    // A page that is slow to show the run may come too late for the one second of the first action.
    const seen = await seenRunning(each);
    expect(seen).toContain("Report");
    expect(seen).not.toContain("Search");
    await expect(card(each, "Search")).toContainText("did not run");
  }

  // It is in the history, and still is after everything died once more.
  for (const again of [false, true]) {
    if (again) {
      await product.kill();
      await product.start();
    }
    await mari.page.goto(`${product.url}/runs`);
    await mari.page.getByRole("link", { name: /task_1/ }).click();
    await expect(mari.page.getByText(/Ada/).first()).toBeVisible();
    await expect(mari.page.getByText(/finished/i).first()).toBeVisible();
    await mari.page.screenshot({ path: test.info().outputPath(`history-${again}.png`) });
  }
  expect(ada.failures).toEqual([]);
  expect(mari.failures).toEqual([]);

  // Look answers false: Search runs, Grip does not.
  const version = await product.ask<Version>(`/api/graphs/${id}/versions`, json({}));
  const order = {
    version: version.id,
    digest: version.digest,
    umrf: version.umrf,
    engine: "simulator",
    request_id: crypto.randomUUID(),
    script: {
      behaviours: { Look: [{ after_s: 0.05, result: "on_false" }], "*": [{ after_s: 0.05 }] },
    },
  };
  const started = await product.ask<Run>("/api/runs", json(order), product.runnerUrl);
  await expect
    .poll(
      async () => (await product.ask<Run>(`/api/runs/${started.id}`, {}, product.runnerUrl)).state,
    )
    .toBe("finished");
  const { actions } = await product.ask<Run>(`/api/runs/${started.id}`, {}, product.runnerUrl);
  const ran = Object.keys(actions).filter((name) => actions[name]?.visits.length);
  expect(ran.sort()).toEqual(["Look_0", "Report_0", "Search_0"]);
});

interface Version {
  id: string;
  digest: string;
  umrf: unknown;
}

interface Run {
  id: string;
  state: string;
  actions: Record<string, { visits: unknown[] }>;
}

function json(body: unknown): RequestInit {
  return {
    method: "POST",
    body: JSON.stringify(body),
    headers: { "content-type": "application/json" },
  };
}
