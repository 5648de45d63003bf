/** Everything without a pointer: a graph built from nothing, walked through, linked to. */

import { expect, type Locator, type Page, test } from "@playwright/test";
import { arrows, card, meaningOf, meant, saved } from "./canvas";
import { LONG, Product } from "./product";
import { semantics_test_5 } from "./task-graphs";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

interface Ran {
  readonly id: string;
  readonly actions?: Readonly<
    Record<string, { readonly visits: readonly { readonly result: string | null }[] }>
  >;
}

/** Goes there as a keyboard goes there. */
async function tabTo(page: Page, target: Locator): Promise<void> {
  for (let i = 0; i < 60; i += 1) {
    if (await target.evaluate((element) => element === document.activeElement)) return;
    await page.keyboard.press("Tab");
  }
  throw new Error(`Tab does not lead to ${target}`);
}

/** Chooses in a list that opens. */
async function choose(page: Page, field: Locator, option: string): Promise<void> {
  await tabTo(page, field);
  await page.keyboard.press("Enter");
  const wanted = page.getByRole("option", { name: option, exact: true });
  await expect(wanted).toBeVisible();
  for (let i = 0; i < 14; i += 1) {
    if ((await wanted.getAttribute("data-combobox-selected")) !== null) break;
    await page.keyboard.press("ArrowDown");
  }
  await page.keyboard.press("Enter");
  await expect(wanted).toBeHidden();
}

async function type(page: Page, text: string): Promise<void> {
  await page.keyboard.press("ControlOrMeta+a");
  await page.keyboard.type(text);
}

/** Goes to an action by its name. */
async function goTo(page: Page, name: string): Promise<void> {
  await page.keyboard.press("ControlOrMeta+k");
  await page.keyboard.type(name);
  await page.keyboard.press("Enter");
  await expect(page.locator(".react-flow__node.selected")).toBeFocused();
}

async function number(page: Page, section: number, name: string): Promise<void> {
  await tabTo(page, page.getByRole("button", { name: "Add", exact: true }).nth(section));
  await page.keyboard.press("Enter");
  const field = page.getByRole("combobox", { name: "Name of the parameter" });
  await expect(field).toBeFocused();
  await page.keyboard.type(name);
  await choose(page, page.getByRole("combobox", { name: "Type of the parameter" }), "number");
  await page.keyboard.press("Shift+Tab");
  await expect(field).toBeFocused();
  await page.keyboard.press("Enter");
}

test("a graph is built from nothing, and means what it shall", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await tabTo(page, page.getByRole("button", { name: "New graph" }).first());
  await page.keyboard.press("Enter");
  await page.waitForURL(/\/graphs\/.+/);
  const id = page.url().split("/").at(-1) ?? "";
  await saved(page);

  // Its name, and the first action with what it takes and gives.
  await page.keyboard.press("F6");
  await page.keyboard.press("Shift+Enter");
  await expect(page.getByRole("textbox", { name: "Graph", exact: true })).toBeFocused();
  await type(page, semantics_test_5.graph_name);
  await page.keyboard.press("Tab");
  await page.keyboard.type(semantics_test_5.graph_description);
  await page.keyboard.press("F6");
  await page.keyboard.press("a");
  await page.keyboard.type("TaTimer");
  await page.keyboard.press("Enter");
  await expect(card(page, "TaTimer")).toBeVisible();
  await page.keyboard.press("Shift+Enter");
  await expect(page.getByRole("textbox", { name: "Name", exact: true })).toBeFocused();
  await number(page, 0, "count_until");
  const until = page.getByRole("textbox", { name: /^count_until/ });
  await tabTo(page, until);
  await page.keyboard.type("3.0");
  await page.keyboard.press("Enter");
  await number(page, 1, "final_count");
  await page.keyboard.press("F6");

  // A second one like it; both at the start.
  await page.keyboard.press("ControlOrMeta+d");
  await expect(card(page, "TaTimer", 1)).toBeVisible();
  await page.keyboard.press("Shift+Enter");
  await expect(page.getByRole("textbox", { name: "Name", exact: true })).toBeFocused();
  await tabTo(page, until);
  await type(page, "0.0");
  await page.keyboard.press("F6");
  await page.keyboard.press("ControlOrMeta+a");
  await page.keyboard.press("e");
  await expect.poll(() => arrows(product, id)).toEqual(["entry > TaTimer_0", "entry > TaTimer_1"]);

  // The arrow: when the first is true, the second is stopped …
  await goTo(page, "TaTimer 0");
  await page.keyboard.press("c");
  await expect(page.getByRole("radiogroup", { name: "Outcome" })).toBeVisible();
  await page.keyboard.press("1");
  await expect(page.getByRole("combobox", { name: "To", exact: true })).toBeFocused();
  await page.keyboard.type("timer 1");
  await page.keyboard.press("Enter");
  await expect.poll(() => arrows(product, id)).toContain("TaTimer_0 > TaTimer_1");
  await page.keyboard.press("Shift+Enter");
  const when = (outcome: string) =>
    page.getByRole("combobox", { name: `When TaTimer 0 is ${outcome}` });
  await expect(when("true")).toBeFocused();
  await choose(page, when("true"), "stop · stop it");
  await choose(page, when("false"), "bypass · pass it over");
  await choose(page, when("error"), "bypass · pass it over");
  // What only stops it, or lets it be passed over, does not keep it from starting.
  await expect(page.getByRole("switch", { name: "TaTimer 1 waits for this" })).not.toBeChecked();
  await page.keyboard.press("F6");

  // … and then the graph ends.
  await goTo(page, "TaTimer 1");
  await page.keyboard.press("c");
  await page.keyboard.press("ArrowLeft");
  await expect(page.getByRole("radio", { name: /^stopped/ })).toBeChecked();
  await page.keyboard.type("exit");
  await page.keyboard.press("Enter");
  await expect.poll(() => arrows(product, id)).toContain("TaTimer_1 > exit");
  await saved(page);
  await expect.poll(() => meaningOf(product, id)).toEqual(await meant(product, semantics_test_5));

  // The exported file says it too.
  const download = page.waitForEvent("download");
  await page.keyboard.press("ControlOrMeta+s");
  expect((await download).suggestedFilename()).toBe("semantics_test_5.umrf.graph.json");
  expect(failures).toEqual([]);
  await context.close();
});

test("keys walk the graph, open menus, find commands and copy links", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);

  await goTo(page, "Wait 0");
  await page.keyboard.press("Alt+ArrowRight");
  await expect(card(page, "Wait", 1)).toBeFocused();
  await page.keyboard.press("Alt+ArrowRight");
  await page.keyboard.press("Alt+ArrowLeft");
  await expect(card(page, "Wait", 1)).toBeFocused();

  // The menu of what is chosen.
  await page.keyboard.press("Shift+F10");
  const menu = page.getByRole("menu");
  await expect(menu.getByRole("menuitem", { name: /^Delete and heal/ })).toBeVisible();
  await expect(menu.getByRole("menuitem").first()).toBeFocused();
  await page.keyboard.press("Escape");
  await expect(menu).toBeHidden();

  // An arrow takes in an action; an arrow is chosen by Tab and Enter.
  await page.keyboard.press("c");
  await page.keyboard.type("2Fetch"); // at once: not a letter is lost, and none means an outcome
  await page.keyboard.press("Enter");
  await expect(card(page, "Fetch")).toBeVisible();
  await expect.poll(() => arrows(product, id)).toContain("Wait_1 > Fetch_0");
  await page.keyboard.press("i");
  await page.keyboard.type("Honk");
  await page.keyboard.press("Enter");
  await expect.poll(() => arrows(product, id)).toContain("Honk_0 > Fetch_0");
  expect(await arrows(product, id)).not.toContain("Wait_1 > Fetch_0");

  // The sheet of shortcuts; letters can be switched off.
  await page.keyboard.press("?");
  await expect(page.getByRole("dialog").getByText("Draw an arrow …")).toBeVisible();
  await tabTo(page, page.getByRole("switch", { name: "Single letters are shortcuts" }));
  await page.keyboard.press("Space");
  await page.keyboard.press("Escape");
  await expect(page.getByRole("dialog")).toBeHidden();
  await page.keyboard.press("a");
  await expect(page.getByRole("combobox", { name: "Name of an action" })).toBeHidden();

  // A link to an action, followed by somebody else.
  await goTo(page, "Wait 2");
  await page.keyboard.press("ControlOrMeta+Shift+l");
  await expect(page.getByText("Link copied")).toBeVisible();
  await context.grantPermissions(["clipboard-read"]);
  const link = await page.evaluate(() => navigator.clipboard.readText());
  expect(link).toMatch(new RegExp(`/graphs/${id}\\?action=[A-Za-z0-9]{12}$`));
  const mari = await product.person(browser, "Mari");
  await mari.page.goto(link);
  await expect(card(mari.page, "Wait", 2)).toHaveClass(/selected/);
  await expect(card(mari.page, "Wait", 2)).toBeInViewport();
  await mari.page.goto(`${product.url}/graphs/${id}?action=AAAAAAAAAAAA&problem=H8`);
  await expect(mari.page.getByText("no longer in this graph")).toBeVisible();
  await expect(mari.page.getByRole("tab", { name: /^Problems/ })).toHaveAttribute(
    "aria-selected",
    "true",
  );
  expect([...failures, ...mari.failures]).toEqual([]);
  await mari.context.close();
  await context.close();
});

test("a dry-run is played by keys and records nothing", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(3);
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  // It was laid out on being opened, which is an edit of its own.
  await expect(card(page, "Wait", 0)).toBeVisible();
  await saved(page);
  const { seq: before } = await product.ask<{ seq: number }>(`/api/graphs/${id}`);
  await page.keyboard.press("d");
  const bar = page.getByRole("region", { name: "Dry-run" });
  await expect(bar).toContainText("Wait 0 runs");
  await expect(card(page, "Wait", 0)).toContainText("running");

  // Step, decide, step back and decide otherwise.
  await page.keyboard.press(".");
  await expect(bar).toContainText("Wait 0 ends true");
  await expect(card(page, "Wait", 1)).toContainText("running");
  await page.keyboard.press("3");
  await expect(bar).toContainText("Wait 1 ends with an error");
  await expect(card(page, "Wait", 1)).toContainText("error");
  await page.keyboard.press(",");
  await expect(card(page, "Wait", 1)).toContainText("running");
  await page.keyboard.press("2");
  await expect(bar).toContainText("Wait 1 ends false");
  await expect(card(page, "Wait", 2)).toContainText("running");

  // One fault: it never ends; and Stop is pressed.
  await bar.getByRole("button", { name: "Fault" }).click();
  await page.getByRole("menuitem", { name: "Never ends" }).click();
  await expect(bar).toContainText("The running actions never end on their own");
  await bar.getByRole("button", { name: /Never ends/ }).click();
  await page.getByRole("menuitem", { name: "Stop is pressed now" }).click();
  await expect(bar).toContainText("Wait 2 is asked to stop");
  await bar.getByRole("slider", { name: "Moment" }).focus();
  await page.keyboard.press("End");
  await expect(bar).toContainText("The graph is stopped");

  // From the start it plays by itself; closed, nothing is left of it.
  await bar.getByRole("button", { name: "From the start, undecided" }).click();
  await bar.getByRole("button", { name: "Play and pause" }).click();
  await expect(bar).toContainText("The graph ends: true", { timeout: 15_000 });
  await bar.getByRole("button", { name: "Close the dry-run" }).click();
  await expect(bar).toBeHidden();
  await expect(card(page, "Wait", 0)).not.toContainText(/true|running|waits/);
  const runs = await product.ask<unknown[]>(`/api/runs?graph=${id}`, {}, product.runnerUrl);
  expect(runs).toEqual([]);
  const { seq } = await product.ask<{ seq: number }>(`/api/graphs/${id}`);
  expect(seq).toBe(before);

  // Asked for, it becomes a run that goes as was decided.
  await page.keyboard.press("d");
  await expect(bar).toContainText("Wait 0 runs");
  await page.keyboard.press("3");
  await expect(bar).toContainText("Wait 0 ends with an error");
  await bar.getByRole("button", { name: /^Run in the simulator/ }).focus();
  await page.keyboard.down("Enter");
  await expect(bar).toBeHidden();
  await page.keyboard.up("Enter");
  const first = async () => {
    const [run] = await product.ask<Ran[]>(`/api/runs?graph=${id}`, {}, product.runnerUrl);
    const path = `/api/runs/${run?.id}`;
    return run && (await product.ask<Ran>(path, {}, product.runnerUrl)).actions?.Wait_0;
  };
  await expect.poll(async () => (await first())?.visits[0]?.result).toBe("error");
  expect(failures).toEqual([]);
  await context.close();
});

test("keys of one's own work at once, STOP's cannot be had, and the graph prints as itself", async ({
  browser,
}) => {
  const { page, context } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${await product.chain(2)}`);
  await saved(page);
  await page.keyboard.press("?");
  const pencil = page.getByRole("button", { name: "Other keys for Show the outline" });
  await pencil.focus();
  await page.keyboard.press("Enter");
  await page.keyboard.press("Control+.");
  // STOP heard it, and nobody else did.
  await expect(page.getByRole("button", { name: /^Press the new keys/ })).toBeFocused();
  await page.keyboard.press("Control+Shift+y");
  await page.keyboard.press("Escape");
  await expect(page.getByRole("dialog")).toHaveCount(0);
  await page.keyboard.press("Control+Shift+Y");
  await expect(page.getByRole("treegrid")).toBeVisible();
  await page.evaluate(() => dispatchEvent(new Event("beforeprint")));
  const paper = page.locator("body > [data-print]");
  await expect(paper.locator("svg text", { hasText: "Wait" })).toHaveCount(2);
  await expect(paper).toContainText("never published");
  expect((await page.pdf({ preferCSSPageSize: true })).length).toBeGreaterThan(5_000);
  await page.evaluate(() => dispatchEvent(new Event("afterprint")));
  await expect(paper).toHaveCount(0);
  await context.close();
});
