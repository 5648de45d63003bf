/** A draft: one works apart, the other goes on, both are merged with a choice, and it can be undone. */

import { expect, type Page, test } from "@playwright/test";
import { add, boxOf, card, saved } from "./canvas";
import { type Person, Product } from "./product";
import { violations } from "./valves";

const product = new Product();
let ada: Person;
let mari: Person;
let graph: string;

const VALVES = {
  graph_name: "valves",
  graph_entry: [{ name: "Drive" }],
  graph_exit: [{ name: "Cool" }],
  gui_attributes: { action_assistant: { direction: "right" } },
  actions: [
    {
      name: "Drive",
      type: "sync",
      gui_attributes: { position: { x: 140, y: 120 } },
      input_parameters: { speed: { pvf_type: "number", pvf_value: 0.4 } },
      children: [{ name: "Cool" }],
    },
    {
      name: "Cool",
      type: "sync",
      gui_attributes: { position: { x: 440, y: 120 } },
      parents: [{ name: "Drive" }],
    },
  ],
};

async function choose(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: "Fit", exact: true }).click();
  await boxOf(card(page, name));
  await card(page, name).click({ position: { x: 50, y: 20 } });
}

async function setSpeed(page: Page, value: string): Promise<void> {
  await choose(page, "Drive");
  const field = page.getByRole("textbox", { name: /^speed/ });
  await field.fill(value);
  await field.press("Enter");
  await saved(page);
  await page.keyboard.press("Escape");
  await page.keyboard.press("Escape");
}

async function openHistory(page: Page): Promise<void> {
  await page.getByRole("radiogroup", { name: "What is listed" }).getByText("History").click();
}

const bar = (page: Page) => page.getByRole("region", { name: "Draft", exact: true });
const drafts = (page: Page) => page.getByRole("region", { name: "Drafts", exact: true });
const entries = (page: Page) =>
  page.getByRole("region", { name: "History" }).locator("[data-entry]");

test.beforeAll(async ({ browser }) => {
  await product.start();
  const made = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    body: JSON.stringify(VALVES),
    headers: { "content-type": "application/json" },
  });
  graph = made.id;
  const umrf = await product.ask<object>(`/api/graphs/${graph}/umrf?identities=true`);
  const course = { name: "it drives", graph, umrf, script: { behaviours: {} } };
  const headers = { "content-type": "application/json" };
  const body = JSON.stringify(course);
  await product.ask("/api/expectations", { method: "POST", body, headers }, product.runnerUrl);
  ada = await product.person(browser, "Ada");
  mari = await product.person(browser, "Mari");
  for (const { page } of [ada, mari]) await page.goto(`${product.url}/graphs/${graph}`);
});

test.afterAll(async () => {
  expect([...ada.failures, ...mari.failures]).toEqual([]);
  await product.dispose();
});

test("what is done in a draft changes nothing in its graph", async () => {
  const { page } = mari;
  await openHistory(page);
  await page.getByRole("button", { name: "New draft…" }).click();
  await page.getByRole("textbox", { name: "What will it be about?" }).fill("gentler grip");
  await page.getByRole("button", { name: "Make it" }).click();
  await expect(bar(page)).toContainText("Draft “gentler grip” of valves");
  await expect(bar(page)).toContainText("nothing to merge");
  await setSpeed(page, "0.2");
  await add(page, "Wave");
  await saved(page);
  await expect(bar(page)).toContainText(/\d changes ahead/);
  await expect(card(ada.page, "Drive")).toContainText("0.4");
  await expect(card(ada.page, "Wave")).toHaveCount(0);
  await setSpeed(ada.page, "0.9");
  await add(ada.page, "Horn");
  await saved(ada.page);
  await expect(bar(page)).toContainText(/ahead, \d behind/, { timeout: 20_000 });
  await bar(page).getByRole("button", { name: "Compare" }).click();
  const compared = page.getByRole("dialog");
  await expect(compared).toContainText("set Drive speed 0.4 → 0.2");
  await expect(compared).toContainText("set Drive speed 0.4 → 0.9");
  expect(await violations(page)).toEqual([]);
  await compared.getByRole("button", { name: "Close" }).last().click();
});

test("words typed in a dialog are there again after a reload of the page", async () => {
  const { page } = mari;
  const open = () => bar(page).getByRole("button", { name: "Propose…" }).press("Enter");
  const words = page.getByRole("dialog").getByRole("textbox", { name: "What is it for?" });
  await open();
  await expect(words).toBeFocused();
  await page.keyboard.type("Slips less");
  await page.reload(); // before anything has paused
  await expect(bar(page)).toBeVisible();
  await expect(words).toHaveCount(0);
  await open();
  await expect(words).toHaveValue("Slips less");
  await page.keyboard.press("Escape");
  await expect(words).toHaveCount(0);
});

test("it is proposed, and the other says yes", async () => {
  await bar(mari.page).getByRole("button", { name: "Propose…" }).click();
  await mari.page.getByRole("textbox", { name: "What is it for?" }).fill("It <b>slips</b> less.");
  await mari.page.getByRole("button", { name: "Propose", exact: true }).click();
  await expect(bar(mari.page)).toContainText("Proposed: no answer yet");
  const { page } = ada;
  await openHistory(page);
  await expect(drafts(page)).toContainText("It <b>slips</b> less.", { timeout: 20_000 });
  await drafts(page).getByRole("button", { name: "Yes to gentler grip" }).click();
  await expect(drafts(page)).toContainText("1 yes");
  expect(await violations(page)).toEqual([]);
});

test("a merge asks for what both changed, and both see it", async () => {
  const { page } = ada;
  await drafts(page).getByRole("button", { name: "Merge… gentler grip" }).click();
  const dialog = page.getByRole("dialog");
  await expect(dialog.getByRole("button", { name: "Choose 1 more" })).toBeDisabled();
  const conflict = dialog.getByRole("group", { name: "input speed of Drive_0" });
  await expect(conflict).toContainText("0.4 → 0.9");
  await expect(dialog.getByText("The expected course is taken.")).toBeVisible();
  expect(await violations(page)).toEqual([]);
  await conflict.getByRole("radio", { name: "“gentler grip”" }).check();
  await expect(dialog.getByRole("region", { name: "What changes" })).toContainText(
    "set Drive speed 0.9 → 0.2",
  );
  await dialog.getByRole("button", { name: "Merge", exact: true }).click();
  await expect(dialog).toHaveCount(0);
  await bar(mari.page).getByRole("link", { name: "valves" }).click();
  for (const each of [page, mari.page]) {
    for (const name of ["Wave", "Horn"]) await expect(card(each, name)).toBeVisible();
    await expect(card(each, "Drive")).toContainText("0.2");
  }
  await expect(drafts(page)).toContainText("merged");
  await expect(entries(page).first()).toContainText("merged the draft “gentler grip” by Mari");
});

test("who set a value is who did it in the draft", async () => {
  const { page } = ada;
  await choose(page, "Drive");
  const fields = page.getByRole("list", { name: "Who set what" }).getByRole("listitem");
  await expect(fields.filter({ hasText: "speed" })).toContainText(
    /0\.9\s*0\.2.*Mari.*merged by Ada/,
  );
  await page.keyboard.press("Escape");
});

test("a merge is undone like what somebody did", async () => {
  const { page } = ada;
  await entries(page).first().click();
  await page.getByRole("button", { name: "Undo what Ada did" }).click();
  for (const each of [page, mari.page]) {
    await expect(card(each, "Wave")).toHaveCount(0);
    await expect(card(each, "Horn")).toBeVisible();
    await expect(card(each, "Drive")).toContainText("0.9");
  }
});

test("a draft is deleted, and can be brought back", async () => {
  const { page } = ada;
  await drafts(page).getByRole("button", { name: "Delete the draft gentler grip" }).click();
  await expect(drafts(page).getByRole("listitem")).toHaveCount(0);
  const deleted = await product.ask<{ draft_of?: { name: string } }[]>("/api/graphs?deleted=true");
  expect(deleted.map(({ draft_of }) => draft_of?.name)).toEqual(["gentler grip"]);
});
