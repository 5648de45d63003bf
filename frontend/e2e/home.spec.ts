/** Home and keyboard: rename, duplicate, delete and bring back; Delete, Tab, select all, marquee. */

import { expect, type Page, test } from "@playwright/test";
import { add, boxOf, card, saved } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const menu = async (page: Page, graph: string, item: string) => {
  await page.getByRole("button", { name: `More about ${graph}`, exact: true }).click();
  await page.getByRole("menuitem", { name: item }).click();
};

test("a graph is renamed, duplicated, deleted and brought back", async ({ browser }) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const heading = (name: string) => page.getByRole("heading", { name, exact: true });

  await menu(page, "search_aisles", "Rename …");
  const field = page.getByRole("textbox", { name: "Name of the graph" });
  await field.fill("look_for_pallets");
  await field.press("Enter");
  await expect(heading("look_for_pallets")).toBeVisible();
  await expect(heading("search_aisles")).toHaveCount(0);

  await menu(page, "look_for_pallets", "Duplicate");
  await expect(heading("look_for_pallets copy")).toBeVisible();
  const graphs = await product.ask<{ id: string; name: string; actions: number }[]>("/api/graphs");
  const [one, copy] = ["look_for_pallets", "look_for_pallets copy"].map((name) =>
    graphs.find((graph) => graph.name === name),
  );
  expect(copy?.actions).toBe(one?.actions);
  expect(copy?.id).not.toBe(one?.id);

  await menu(page, "look_for_pallets copy", "Delete");
  await expect(heading("look_for_pallets copy")).toHaveCount(0);
  await page.getByRole("button", { name: "Bring it back" }).click();
  await expect(heading("look_for_pallets copy")).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});

test("keys and marquee: Tab searches, all are selected, Delete deletes, a frame selects", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  await add(page, "One");
  await page.keyboard.press("Escape");

  // Tab over the canvas opens the search; Enter takes what is typed.
  const pane = page.locator(".react-flow__pane");
  const box = await pane.boundingBox();
  if (box === null) throw new Error("no canvas");
  await page.mouse.click(box.x + 40, box.y + 300);
  await page.evaluate(() => (document.activeElement as HTMLElement | null)?.blur());
  await page.keyboard.press("Tab");
  const search = page.getByRole("combobox", { name: "Name of an action" });
  await expect(search).toBeFocused();
  await search.fill("Two");
  await search.press("Enter");
  await expect(card(page, "Two")).toBeInViewport({ ratio: 1 }); // the view glides there

  const selected = page.locator(".react-flow__node-action.selected");
  await page.mouse.click(box.x + box.width - 60, box.y + 300);
  await expect(selected).toHaveCount(0);
  await page.keyboard.press("ControlOrMeta+a");
  await expect(selected).toHaveCount(2);
  await page.keyboard.press("Delete");
  await expect(page.locator(".react-flow__node-action")).toHaveCount(0);
  await page.keyboard.press("ControlOrMeta+z");
  await expect(page.locator(".react-flow__node-action")).toHaveCount(2);

  // A frame drawn round one of them selects that one.
  await page.keyboard.press("v");
  const two = await boxOf(card(page, "Two"));
  await page.mouse.move(two.x - 14, two.y - 10);
  await page.mouse.down();
  await page.mouse.move(two.x + two.width / 2, two.y + two.height / 2, { steps: 6 });
  await page.mouse.move(two.x + two.width + 10, two.y + two.height + 14, { steps: 6 });
  await page.mouse.up();
  await expect(card(page, "Two")).toHaveClass(/selected/);
  await page.keyboard.press("Backspace");
  await expect(card(page, "Two")).toHaveCount(0);
  await expect(card(page, "One")).toBeVisible();
  await saved(page);
  expect(failures).toEqual([]);
  await context.close();
});

test("graphs are moved into folders by keys, found there, and none is lost with a folder", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const heading = (name: string) => page.getByRole("heading", { name, exact: true });
  const folder = (name: string) =>
    page.getByRole("region", { name: "Folders" }).getByRole("link", { name });
  const dialog = page.getByRole("dialog");

  await page.getByRole("button", { name: "New folder" }).click();
  await dialog.getByRole("textbox", { name: "Name of the folder" }).fill("Lab");
  await page.keyboard.press("Enter");
  await expect(folder("Lab")).toContainText("0 graphs");

  // By keys alone: the menu of the graph, a new folder inside of the one that arrows choose.
  const { name } = (await product.ask<{ name: string }[]>("/api/graphs"))[0] ?? { name: "" };
  await page.getByRole("button", { name: `More about ${name}`, exact: true }).focus();
  await page.keyboard.press("Enter");
  await page.getByRole("menuitem", { name: "Move to folder" }).focus();
  await page.keyboard.press("Enter");
  await expect(dialog.getByRole("radio", { name: "No folder" })).toBeFocused();
  await page.keyboard.press("ArrowDown");
  await expect(dialog.getByRole("radio", { name: "Lab" })).toBeChecked();
  await page.keyboard.press("Tab");
  await page.keyboard.type("Night");
  await page.keyboard.press("Enter");
  await expect(heading(name)).toHaveCount(0);

  await folder("Lab").click();
  await expect(folder("Night")).toContainText("1 graph");
  await page.getByRole("textbox", { name: "Search graphs" }).fill(name);
  await expect(heading(name)).toBeVisible();
  await expect(page.getByText("In Lab / Night")).toBeVisible();
  await page.getByRole("textbox", { name: "Search graphs" }).fill("");

  await folder("Night").click();
  await expect(heading(name)).toBeVisible();
  const graph = await product.ask<{ folder?: string }[]>("/api/graphs");
  await page.getByRole("button", { name: "New graph" }).first().click();
  await page.waitForURL(/\/graphs\/.+/);
  const made = new URL(page.url()).pathname.split("/").at(-1);
  const filed = await product.ask<{ folder?: string }>(`/api/graphs/${made}`);
  expect(graph.map((each) => each.folder)).toContain(filed.folder);
  await page.goBack();

  await page.getByRole("button", { name: "More about the folder Night" }).click();
  await page.getByRole("menuitem", { name: "Remove the folder" }).click();
  await expect(dialog).toContainText("(2 graphs) go into");
  await dialog.getByRole("button", { name: "Remove the folder" }).click();
  await expect(heading("Folder Lab")).toBeVisible();
  await expect(heading(name)).toBeVisible();
  expect(failures).toEqual([]);
  await context.close();
});

test("of many graphs a page is loaded, more by keys, and a search finds what is not loaded", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  for (let n = 0; n < 70; n += 1) {
    await product.ask("/api/graphs", {
      method: "POST",
      body: JSON.stringify({ name: `many ${n}` }),
    });
  }
  const asked: string[] = [];
  page.on("request", (request) =>
    asked.push(new URL(request.url()).pathname + new URL(request.url()).search),
  );
  await page.reload();
  const cards = page.getByRole("article");
  await expect(cards).toHaveCount(60);
  const more = page.getByRole("button", { name: /^More graphs \(60 of \d+\)$/ });
  await page.getByRole("textbox", { name: "Search graphs" }).fill("many 3");
  await expect(cards).toHaveCount(16); // both words stand in them: 3, 13, 30 …
  await expect(page.getByRole("heading", { name: "many 3", exact: true })).toBeVisible();
  await expect(more).toHaveCount(0);
  await page.getByRole("textbox", { name: "Search graphs" }).fill("");
  await expect(cards).toHaveCount(60);
  await more.focus();
  await page.keyboard.press("Enter");
  await expect(page.getByRole("heading", { name: "many 0", exact: true })).toHaveCount(1);
  await page.getByRole("combobox", { name: "Sort by" }).selectOption("Name");
  const manyNames = async () => {
    const names = await cards.getByRole("heading").allTextContents();
    return names.filter((name) => /^many \d+$/.test(name)).slice(0, 11);
  };
  await expect.poll(manyNames).toEqual(Array.from({ length: 11 }, (_, n) => `many ${n}`));
  expect(asked).not.toContain("/api/graphs");
  expect(failures).toEqual([]);
  await context.close();
});

test("while a graph is opening it has the name that its list said, or none", async ({
  browser,
}) => {
  const { page, context, failures } = await product.person(browser, "Ada");
  const id = await product.chain(1);
  await page.goto(product.url);
  const link = page.getByRole("article").filter({ hasText: "chain_1" }).getByRole("link").first();
  await expect(link).toBeVisible();
  // Its room gives no answer yet.
  await page.routeWebSocket(new RegExp(id), () => {});
  await link.click();
  await expect(page).toHaveURL(new RegExp(id));
  const where = page.getByRole("navigation", { name: "Where you are" });
  await expect(where).toContainText("chain_1");
  await page.reload();
  await expect(where).toBeVisible();
  await expect(where).not.toContainText("Untitled");
  expect(failures).toEqual([]);
  await context.close();
});
