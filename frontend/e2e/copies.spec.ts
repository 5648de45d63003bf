/** An action is tried again, and duplicated with other values: by mouse, by keys, by fingers. */

import { expect, type Page, test } from "@playwright/test";
import { arrows, card, meaningOf, pick, saved } from "./canvas";
import { type Person, Product } from "./product";
import { post, violations } from "./valves";

const product = new Product();
let ada: Person;
let task: string;

const when = (response: string) =>
  ["on_true", "on_false", "on_error", "on_stopped"].map((end) =>
    end === response ? `${end} -> run` : `${end} -> ignore`,
  );

/** DriveTo leads to Grip when it is true and to Help when it fails. */
const FETCH = {
  graph_name: "fetch",
  graph_entry: [{ name: "DriveTo" }],
  graph_exit: ["Grip", "Help"].map((name) => ({
    name,
    required: false,
    conditions: when("on_true"),
  })),
  actions: [
    {
      name: "DriveTo",
      type: "sync",
      input_parameters: { place: { pvf_type: "string", pvf_value: "dock" } },
      children: [{ name: "Grip" }, { name: "Help" }],
    },
    {
      name: "Grip",
      type: "sync",
      parents: [{ name: "DriveTo", conditions: when("on_true") }],
    },
    {
      name: "Help",
      type: "sync",
      parents: [{ name: "DriveTo", conditions: when("on_error") }],
    },
  ],
};

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
});
test.beforeEach(async () => {
  task = (await post<{ id: string }>(product, "/api/graphs", FETCH)).id;
  await ada.page.goto(`${product.url}/graphs/${task}`);
  await saved(ada.page);
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

const dialog = (page: Page, name: string) => page.getByRole("dialog", { name });

test("the details of an action draw further tries of it, and one undo takes them back", async () => {
  const { page } = ada;
  const before = await arrows(product, task);
  await pick(page, ["DriveTo", 0]);
  await page.getByRole("button", { name: "Try again …" }).click();
  const tries = dialog(page, "Try DriveTo again");
  await tries.getByRole("combobox", { name: "Try it up to" }).selectOption("3 times");
  await expect(tries).toContainText("Draws 2 more of DriveTo. Each further try begins");
  expect(await violations(page)).toEqual([]);
  await tries.getByRole("button", { name: "Draw it" }).click();
  await expect(tries).toBeHidden();
  await expect(card(page, "DriveTo", 2)).toBeVisible();
  await saved(page);
  const drawn = await arrows(product, task);
  expect(drawn.filter((arrow) => arrow.includes("Help"))).toHaveLength(2);
  expect(drawn).toHaveLength(before.length + 4);
  await page.keyboard.press("F6");
  await page.keyboard.press("ControlOrMeta+z");
  await expect.poll(() => arrows(product, task)).toEqual(before);
});

test("by keys alone copies with other values follow each other", async () => {
  const { page } = ada;
  await pick(page, ["DriveTo", 0]);
  await page.keyboard.press("ControlOrMeta+k");
  await page.keyboard.type("Duplicate with");
  await page.keyboard.press("Enter");
  const copies = dialog(page, "Duplicate DriveTo with …");
  await expect(copies.getByRole("textbox", { name: "Values, one a line" })).toBeFocused();
  await page.keyboard.type("hall");
  await page.keyboard.press("Enter");
  await page.keyboard.type("lab");
  await expect(copies).toContainText("Draws 2 copies of DriveTo with place hall, lab, one after");
  for (let i = 0; i < 3; i += 1) await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await expect(copies).toBeHidden();
  await expect(card(page, "DriveTo", 2)).toContainText("lab");
  await saved(page);
  expect(await arrows(product, task)).toEqual(
    expect.arrayContaining([
      "DriveTo_0 > DriveTo_1",
      "DriveTo_1 > DriveTo_2",
      "DriveTo_2 > Grip_0",
    ]),
  );
});

test("with fingers a resting one opens the menu, which duplicates with another robot", async ({
  browser,
}) => {
  const { page, failures } = await product.person(browser, "Mari", {
    viewport: { width: 390, height: 844 },
    hasTouch: true,
    isMobile: true,
  });
  await page.goto(`${product.url}/graphs/${task}`);
  await saved(page);
  await page.getByText("Canvas", { exact: true }).tap();
  const box = await card(page, "Grip").boundingBox();
  if (box === null) throw new Error("no card of Grip");
  const cdp = await page.context().newCDPSession(page);
  const at = { x: box.x + box.width / 4, y: box.y + box.height / 3, id: 0 };
  await cdp.send("Input.dispatchTouchEvent", { type: "touchStart", touchPoints: [at] });
  const item = page.getByRole("menuitem", { name: "Duplicate with …" });
  await item.waitFor();
  await cdp.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  await item.tap();
  const copies = dialog(page, "Duplicate Grip with …");
  await copies.getByRole("textbox", { name: "Values, one a line" }).fill("Scout\nCarrier");
  await copies.getByRole("checkbox", { name: "One after another" }).tap();
  await expect(copies).toContainText("with robot Scout, Carrier, side by side");
  await copies.getByRole("button", { name: "Draw it" }).tap();
  await expect(copies).toBeHidden();
  await saved(page);
  const text = JSON.stringify(await meaningOf(product, task));
  expect(text.match(/"actor":"(Scout|Carrier)"/g)).toHaveLength(2);
  expect(failures).toEqual([]);
});
