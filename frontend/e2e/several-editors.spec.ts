/**
 * Two people at two editors of one Postgres draw in one graph while the editor that has it open is killed, and a run
 * is stopped meanwhile: both go on by themselves, what was shown as saved is kept, and both see the same.
 */

import { type Browser, expect, type Page, request, test } from "@playwright/test";
import { add, CARD, card, saved, start, type Umrf } from "./canvas";
import { missingParts, SeveralEditors } from "./several-editors";

test.skip(missingParts() !== "", missingParts());

const several = new SeveralEditors();
test.beforeAll(() => several.start());
test.afterAll(() => several.dispose());

/** Make a request as a program does. */
async function ask<T>(path: string, data?: object, userAgent = "program"): Promise<T> {
  const authorization = `Bearer ${several.token}`;
  const made = await request.newContext({
    baseURL: several.url,
    ignoreHTTPSErrors: true,
    userAgent,
    extraHTTPHeaders: { authorization },
  });
  const answer = await (data === undefined ? made.get(path) : made.post(path, { data }));
  const found = { ok: answer.ok(), json: answer.ok() ? await answer.json() : await answer.text() };
  await made.dispose();
  expect(found.ok, JSON.stringify(found.json)).toBe(true);
  return found.json as T;
}

/** Return the name of a browser that nginx leads to an editor for a graph. */
async function browserAt(editor: number, graph: string): Promise<string> {
  for (let n = 0; ; n += 1) {
    const userAgent = `browser ${n}`;
    const made = await request.newContext({ ignoreHTTPSErrors: true, userAgent });
    const answer = await made.get(`${several.url}/api/graphs/${graph}`);
    await made.dispose();
    const led = `http://${answer.headers()["x-editor"]}`;
    expect(several.editors).toContain(led);
    if (led === several.editors[editor]) return userAgent;
  }
}

interface Somebody {
  page: Page;
  failures: string[];
}

/** Somebody comes by nginx with a browser of this name. */
async function come(browser: Browser, name: string, userAgent: string): Promise<Somebody> {
  const context = await browser.newContext({ ignoreHTTPSErrors: true, userAgent });
  const page = await context.newPage();
  const failures: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  await page.goto(`${several.url}/#t=${several.token}`);
  const field = page.getByRole("textbox", { name: /others see you/i });
  await field.fill(name);
  await field.press("Enter");
  await field.waitFor({ state: "detached" });
  return { page, failures };
}

/** Note from now on all that the page says of what is saved. */
async function listen(page: Page): Promise<void> {
  await page.evaluate(() => {
    const heard = new Set<string>();
    Object.assign(window, { heard });
    const look = () => {
      for (const each of document.querySelectorAll("[role=status]"))
        heard.add(each.textContent ?? "");
    };
    new MutationObserver(look).observe(document, {
      subtree: true,
      childList: true,
      characterData: true,
    });
  });
}

const heard = (page: Page) =>
  page.evaluate(() => [...(Reflect.get(window, "heard") as Set<string>)].join(" | "));

/** A picture for who looks, when a folder for them is named. */
async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env.EDITORS_PICTURES;
  if (folder !== undefined) await page.screenshot({ path: `${folder}/${name}.png` });
}

async function draw(page: Page, names: readonly string[]): Promise<void> {
  for (const name of names) await add(page, name);
}

const numbered = (letter: string) => [0, 1, 2, 3, 4].map((n) => `${letter}${n}`);
const stopButton = (page: Page) => page.getByRole("button", { name: /^Stop run/ });

test("a killed editor costs two people nothing, and delays no Stop", async ({ browser }) => {
  test.setTimeout(180_000);
  const wait = (instance_id: number) => ({ name: "Wait", instance_id });
  const actions = Array.from({ length: 30 }, (_, i) => ({
    ...wait(i),
    type: "sync",
    parents: i === 0 ? [] : [wait(i - 1)],
    children: i === 29 ? [] : [wait(i + 1)],
  }));
  const graph_exit = [wait(29)];
  const file = { graph_name: "long", graph_entry: [wait(0)], graph_exit, actions };
  const run = (await ask<{ id: string }>("/api/graphs", file)).id;
  const graph = (await ask<{ id: string }>("/api/graphs", { name: "both" })).id;
  const ada = await come(browser, "Ada", await browserAt(0, graph));
  await ada.page.goto(`${several.url}/graphs/${graph}`);
  await add(ada.page, "First");
  await saved(ada.page);
  expect(await several.owner(graph)).toBe(0);
  const mari = await come(browser, "Mari", await browserAt(1, graph));
  await mari.page.goto(`${several.url}/graphs/${graph}`);
  await expect(card(mari.page, "First")).toBeVisible();
  await expect(ada.page.getByText("Also here: Mari")).toBeAttached();

  const op = await come(browser, "Olga", await browserAt(2, run));
  await op.page.goto(`${several.url}/graphs/${run}`);
  await saved(op.page);
  await start(op.page);
  await expect(stopButton(op.page)).toBeVisible();
  for (const { page } of [ada, mari]) await listen(page);

  // The editor that has the graph open, and that serves the page itself, is killed while both draw.
  const drawn = Promise.all([draw(ada.page, numbered("Ada")), draw(mari.page, numbered("Mari"))]);
  await expect(card(ada.page, "Mari1")).toBeVisible();
  await several.kill(0);
  await stopButton(op.page).click();
  await expect(op.page.getByText(/Run \d+: stopped/)).toBeVisible();
  await drawn;
  await picture(ada.page, "drawn");
  await saved(ada.page);
  await saved(mari.page);
  expect([1, 2]).toContain(await several.owner(graph));
  expect(await heard(ada.page)).toMatch(/Server away/);

  const all = ["First", ...numbered("Ada"), ...numbered("Mari")].sort();
  const names = ({ actions }: Umrf) => actions.map(({ name }) => name).sort();
  for (const editor of [1, 2]) {
    const at = await browserAt(editor, graph);
    expect(names(await ask<Umrf>(`/api/graphs/${graph}/umrf`, undefined, at))).toEqual(all);
  }
  for (const { page } of [ada, mari]) await expect(page.locator(CARD)).toHaveCount(all.length);

  // The next start is that of a page whose editor is another one now, and the killed one comes back.
  await start(op.page);
  await expect(stopButton(op.page)).toBeVisible();
  await several.again(0);
  await add(mari.page, "Last");
  await expect(card(ada.page, "Last")).toBeVisible();
  await saved(mari.page);
  await stopButton(op.page).click();
  await expect(op.page.getByText(/Run \d+: stopped/).last()).toBeVisible();
  await picture(op.page, "stopped");
  await picture(mari.page, "last");
  expect([ada, mari, op].flatMap(({ failures }) => failures)).toEqual([]);
});
