/** The library of actions: made, used, changed with the graphs that use it, imported; by keys and on a phone. */

import { expect, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { action, choose, leaf, list, post, using } from "./library-actions";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

async function addParameter(page: Page, name: string, type: string): Promise<void> {
  await page.getByRole("button", { name: "Add", exact: true }).first().click();
  await page.getByRole("combobox", { name: "Name of the parameter" }).fill(name);
  await page.keyboard.press("Escape");
  await page.getByRole("combobox", { name: "Type of the parameter" }).click();
  await page.getByRole("option", { name: type, exact: true }).click();
  await page.locator("form").getByRole("button", { name: "Add", exact: true }).click();
  const rows = type === "pose"; // its numbers stand in rows, with one button for all of them
  const more = rows ? `The numbers of ${name} one by one` : `What the parameter ${name} is`;
  await expect(page.getByRole("button", { name: more })).toBeVisible();
}

async function renameParameter(page: Page, from: string, to: string): Promise<void> {
  await page.getByRole("button", { name: `What the parameter ${from} is` }).click();
  const settings = page.getByRole("region", { name: `What the parameter ${from} is` });
  await settings.getByRole("textbox", { name: "Name" }).fill(to);
  await page.keyboard.press("Enter");
}

test("an action with a pose is made from nothing and used in a graph", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.getByRole("link", { name: "Actions", exact: true }).click();
  await page.getByRole("button", { name: "New action" }).click();
  await page.getByRole("textbox", { name: "Name" }).fill("GripPallet");
  await page.keyboard.press("Enter");
  await saved(page);
  await expect(page.getByText("libgrip_pallet.so")).toBeVisible();
  await addParameter(page, "grip", "pose");
  await addParameter(page, "force", "number");
  await page.getByRole("textbox", { name: "Description" }).fill("Takes a pallet by its side");
  await page.getByRole("button", { name: "Done" }).click();
  const takes = page.getByRole("table", { name: "Takes" });
  await expect(takes.getByRole("row", { name: /grip pose/ })).toBeVisible();
  await expect(takes.getByRole("row", { name: /force number/ })).toBeVisible();
  await saved(page);
  await page.getByRole("button", { name: /input_parameters\.hpp$/ }).click();
  await expect(page.locator("pre")).toContainText("force");

  await page.goto(`${product.url}/graphs/${await using(product, "lifting", action("Wait", {}))}`);
  await saved(page);
  const library = page.getByRole("complementary", { name: "Library" });
  await library.getByText("Actions", { exact: true }).click();
  await library.getByRole("button", { name: /^GripPallet/ }).click();
  await expect(card(page, "GripPallet")).toBeVisible();
  await saved(page);
  await page.goto(`${product.url}/actions`);
  await list(page)
    .getByRole("link", { name: /GripPallet/ })
    .click();
  await expect(page.getByRole("list", { name: "Graphs that use it" })).toContainText("lifting");
  expect(failures).toEqual([]);
  await context.close();
});

test("a parameter is called otherwise, and graphs follow after a look", async ({ browser }) => {
  const speed = (value: number) => ({ speed: leaf("number", { pvf_value: value }) });
  const night = await using(product, "night_round", action("DriveSlowly", speed(3)));
  await using(product, "day_round", action("DriveSlowly", speed(5)));
  const evening = await using(product, "evening_round", action("DriveSlowly", speed(4)));
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/actions?name=DriveSlowly`);
  await page.getByRole("button", { name: "Add to the library" }).click();
  await saved(page);
  await page.getByRole("button", { name: "Edit" }).click();
  await renameParameter(page, "speed", "velocity");
  const older = page.getByRole("region", { name: "Older parameters" });
  await expect(older).toContainText("3 graphs still use the older parameters.");
  await older.getByRole("button", { name: "Look and update" }).click();
  const dialog = page.getByRole("dialog", { name: "Graphs that use DriveSlowly" });
  // Until somebody says that it is the same, the value would be lost.
  await expect(dialog.getByRole("list", { name: "What changes in night_round" })).toContainText(
    "number, = 3",
  );
  const renamed = dialog.getByRole("checkbox", { name: "speed is now velocity" });
  await expect(renamed).not.toBeChecked();
  await renamed.check();
  await expect(
    dialog.getByRole("list", { name: "What changes in night_round" }).locator("ins"),
  ).toContainText("number, = 3");

  // Somebody changes one of them meanwhile: nothing is written, and the place is told.
  await expect(dialog.getByRole("button", { name: "Update 3 graphs" })).toBeEnabled();
  const patch = { method: "PATCH", body: JSON.stringify({ description: "at night" }) };
  const headers = { "content-type": "application/json" };
  await product.ask(`/api/graphs/${night}`, { ...patch, headers });
  await dialog.getByRole("button", { name: "Update 3 graphs" }).click();
  await expect(dialog.getByRole("alert")).toContainText("night_round");
  await dialog.getByRole("button", { name: "Update 3 graphs" }).click();
  await expect(dialog.getByRole("status").first()).toContainText("3 graphs are updated");
  await expect(older).toBeHidden();
  await dialog.getByRole("link", { name: "History of night_round" }).click();
  const taken = page.getByRole("region", { name: "History" }).getByRole("listitem");
  await expect(taken.filter({ hasText: "took parameters" })).toContainText("velocity");
  const now = await product.ask<object>(`/api/graphs/${night}/umrf`);
  expect(JSON.stringify(now)).toMatch(/"velocity":\{[^}]*"pvf_value":3/);
  const later = await product.ask<object>(`/api/graphs/${evening}/umrf`);
  expect(JSON.stringify(later)).toMatch(/"velocity":\{[^}]*"pvf_value":4/);
  expect(failures).toEqual([]);
  await context.close();
});

test("errors of the last build are shown at the action, until it builds", async ({ browser }) => {
  const { id } = await post(product, "/api/actions", action("WeldSeam", {}));
  const told = (ended_well: boolean, errors: object[]) =>
    product.ask(`/api/actions/${id}/build`, {
      method: "PUT",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({
        ...{ package: "weld_seam", ended_well, at: "2026-11-23T10:00:00Z", errors },
      }),
    });
  const message = "‘torch’ was not declared <b>in this scope</b>";
  await told(false, [{ file: "src/weld_seam.cpp", line: 25, column: 5, message }]);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/actions/${id}`);
  const build = page.getByRole("region", { name: "Last build" });
  await expect(build).toContainText("1 error");
  await expect(build.getByRole("listitem")).toHaveText(`src/weld_seam.cpp:25:5 ${message}`);
  await told(true, []);
  await page.reload(); // it would look by itself, seconds later
  await expect(build).toContainText("built");
  await expect(build.getByRole("listitem")).toHaveCount(0);
  expect(failures).toEqual([]);
  await context.close();
});

test("edits of an action are undone, and its history leads back", async ({ browser }) => {
  const { id } = await post(product, "/api/actions", { name: "LookAround" });
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/graphs/${id}`);
  await expect(page).toHaveURL(`${product.url}/actions/${id}`);
  await page.getByRole("button", { name: "Edit" }).click();
  await saved(page);
  const name = page.getByRole("textbox", { name: "Name", exact: true });
  await name.fill("class");
  await name.press("Enter");
  await expect(page.getByText(/No C\+\+ package: .*a word of C\+\+/)).toBeVisible();
  await page.getByRole("button", { name: "Undo" }).click();
  await expect(page.getByText("liblook_around.so")).toBeVisible();
  await addParameter(page, "angle", "number");
  await saved(page);
  await page.getByRole("tab", { name: "History" }).click();
  await page
    .getByRole("button", { name: /^Restore/ })
    .last()
    .click();
  await expect(page.getByText("Takes none.")).toBeVisible();
  await expect(page.getByRole("list", { name: "History" })).toContainText("went back");
  expect(failures).toEqual([]);
  await context.close();
});

test("two people edit an action at once, and see each other", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { id } = await post(product, "/api/actions", action("Together", { depth: leaf("number") }));
  const ada = await product.person(browser, "Ada");
  const ben = await product.person(browser, "Ben");
  for (const { page } of [ada, ben]) await page.goto(`${product.url}/actions/${id}?edit`);
  await expect(ada.page.getByText("Also here: Ben")).toBeAttached();
  const text = (page: Page) => page.getByRole("textbox", { name: "Description" });
  await text(ada.page).fill("goes down");
  await expect(ben.page.getByText("Ada is writing").first()).toBeAttached();
  await expect(text(ben.page)).toHaveValue("goes down");
  await renameParameter(ben.page, "depth", "below");
  await expect(ada.page.getByRole("button", { name: "What the parameter below is" })).toBeVisible();
  await saved(ben.page);
  for (const { failures, context } of [ada, ben]) {
    expect(failures).toEqual([]);
    await context.close();
  }
});

test("an action is talked about, also one of its parameters", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { id } = await post(
    product,
    "/api/actions",
    action("TurnWheel", { speed: leaf("number") }),
  );
  const ada = await product.person(browser, "Ada");
  const ben = await product.person(browser, "Ben");
  for (const { page } of [ada, ben]) await page.goto(`${product.url}/actions/${id}`);
  await ada.page.getByRole("tab", { name: "Comments", exact: true }).click();
  await ada.page.getByRole("textbox", { name: "Comment on TurnWheel" }).fill("In <b>m/s</b>?");
  await ada.page.getByRole("combobox", { name: "What it is about" }).selectOption("about speed");
  await ada.page.getByRole("button", { name: "Comment", exact: true }).click();
  await saved(ada.page);

  await ben.page.getByRole("tab", { name: "Comments, 1 open" }).click();
  const thread = ben.page.getByRole("tabpanel").getByRole("listitem");
  await expect(thread).toContainText("speed");
  await expect(thread).toContainText("In <b>m/s</b>?");
  await thread.getByRole("button", { name: "Answer" }).click();
  await ben.page.getByRole("textbox", { name: "Answer" }).fill("Yes.");
  await thread.getByRole("button", { name: "Answer" }).click();
  await expect(ada.page.getByRole("tabpanel").getByRole("listitem")).toContainText("Yes.");
  await thread.getByRole("button", { name: "Resolve" }).click();
  await expect(ada.page.getByRole("tab", { name: "Comments", exact: true })).toBeVisible();
  for (const { failures, context } of [ada, ben]) {
    expect(failures).toEqual([]);
    await context.close();
  }
});

test("files of actions are imported into the library, many at once", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/actions`);
  await choose(page, [
    { name: "open.umrf.json", body: action("OpenHatch", { x: leaf("number") }) },
  ]);
  await expect(page.getByRole("heading", { name: "OpenHatch", level: 1 })).toBeVisible();
  await expect(page.getByRole("table", { name: "Takes" })).toContainText("number");
  await choose(page, [
    { name: "a.umrf.json", body: action("OpenHatch", { x: leaf("string") }) },
    { name: "b.umrf.json", body: action("ShutHatch", {}) },
    { name: "c.umrf.json", body: action("WatchHatch", {}) },
    { name: "d.json", body: { nothing: true } },
  ]);
  await expect(list(page).getByRole("link", { name: /WatchHatch/ })).toBeVisible();
  await expect(page.getByText("d.json:")).toBeVisible();
  await page.getByRole("button", { name: "Replace them by the files" }).click();
  await list(page)
    .getByRole("link", { name: /OpenHatch/ })
    .click();
  await expect(page.getByRole("table", { name: "Takes" })).toContainText("string");
  expect(failures).toEqual([]);
  await context.close();
});

test("an action is made, found and deleted by keys alone", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/actions`);
  await expect(list(page)).toBeVisible();
  await page.keyboard.press("/");
  await page.keyboard.type("ByKeys");
  const fresh = page.getByRole("button", { name: "New action “ByKeys”" });
  await expect(fresh).toBeVisible();
  await page.keyboard.press("ArrowDown");
  await expect(fresh).toBeFocused();
  await page.keyboard.press("Enter");
  await expect(page.getByRole("textbox", { name: "Name" })).toHaveValue("ByKeys");
  await page.keyboard.press("Enter");
  await expect(page.getByText("libby_keys.so")).toBeVisible();
  const describe = page.getByRole("textbox", { name: "Description" });
  for (
    let i = 0;
    i < 40 && !(await describe.evaluate((it) => it === document.activeElement));
    i += 1
  )
    await page.keyboard.press("Tab");
  await page.keyboard.type("made by keys");
  await page.keyboard.press("Tab");
  await saved(page);
  await page.keyboard.press("Escape");
  await page.getByRole("button", { name: "More about ByKeys" }).focus();
  await page.keyboard.press("Enter");
  await page.getByRole("menuitem", { name: "Delete from the library" }).focus();
  await page.keyboard.press("Enter");
  await expect(page).toHaveURL(/\/actions$/);
  await page.getByRole("button", { name: "Deleted actions" }).focus();
  await page.keyboard.press("Enter");
  await page.getByRole("button", { name: "Bring back ByKeys" }).focus();
  await page.keyboard.press("Enter");
  await expect(page.getByText("Nothing is deleted.")).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});

test("on a phone the list and the action follow each other, and nothing is too wide", async ({
  browser,
}) => {
  const { id } = await post(
    product,
    "/api/actions",
    action("PhoneAction", { far: leaf("number") }),
  );
  const phone = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };
  const { page, context, failures } = await product.person(browser, "Ada", phone);
  await page.getByRole("link", { name: "Actions", exact: true }).tap();
  await list(page)
    .getByRole("link", { name: /PhoneAction/ })
    .tap();
  await expect(page).toHaveURL(new RegExp(`/actions/${id}$`));
  await expect(page.getByRole("heading", { name: "PhoneAction", level: 2 })).toBeVisible();
  await expect(page.getByText("older parameters")).not.toBeVisible();
  const width = () => page.evaluate(() => document.documentElement.scrollWidth);
  expect(await width()).toBeLessThanOrEqual(390);
  await page.getByRole("button", { name: "Edit" }).tap();
  await expect(page.getByRole("textbox", { name: "Description" })).toBeVisible();
  expect(await width()).toBeLessThanOrEqual(390);
  for (const name of ["Done", "More about PhoneAction"]) {
    const box = await page.getByRole("button", { name }).boundingBox();
    expect(box?.height).toBeGreaterThanOrEqual(44);
  }
  await page.getByRole("link", { name: "All actions" }).tap();
  await expect(list(page).getByRole("link", { name: /PhoneAction/ })).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});

test("a thousand actions are searched without waiting", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.route("**/api/actions", async (route) => {
    const one = { description: "moves something from here to there", type: "sync", labels: [] };
    const known = { used_in: [], differs_in: [], first_seen: "2026-01-01T00:00:00Z", seq: 1 };
    const parameter = { pvf_type: "number", required: true, text: '{"pvf_type":"number"}' };
    const inputs = ["speed", "place"].map((path) => ({ path, ...parameter }));
    const json = Array.from({ length: 1000 }, (_, i) => {
      const name = `Action${String(i).padStart(4, "0")}`;
      return { ...one, ...known, name, inputs, outputs: [], document: `d${i}` };
    });
    await route.fulfill({ json });
  });
  await page.goto(`${product.url}/actions`);
  const rows = list(page).getByRole("link");
  await expect(rows).toHaveCount(1000);
  // From the key to the first frame with what was found, beside what the browser itself takes to lay out as
  // many plain rows: that says how quick this machine is.
  const { search, plain } = await page
    .getByRole("textbox", { name: "Search actions" })
    .evaluate(async (field) => {
      const median = (times: number[]) => times.sort((a, b) => a - b)[2] ?? 0;
      const setter = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set;
      const searched: number[] = [];
      const laidOut: number[] = [];
      for (const text of ["a", "action09", "action0999", "action0", ""]) {
        const start = performance.now();
        setter?.call(field, text);
        field.dispatchEvent(new Event("input", { bubbles: true }));
        const count = () => document.querySelectorAll("a[data-row]").length;
        const wanted = { a: 1000, action09: 100, action0999: 1, action0: 1000, "": 1000 }[text];
        while (count() !== wanted) await new Promise(requestAnimationFrame);
        searched.push(performance.now() - start);
        const then = performance.now();
        const rows = document.createElement("div");
        for (let n = 0; n < 1000; n++) rows.append(document.createElement("p"));
        for (const row of rows.children) row.textContent = "Action0000 moves something";
        document.body.append(rows);
        rows.getBoundingClientRect();
        rows.remove();
        laidOut.push(performance.now() - then);
      }
      return { search: median(searched), plain: median(laidOut) };
    });
  expect(search).toBeLessThan(2 * plain);
  expect(failures).toEqual([]);
  await context.close();
});
