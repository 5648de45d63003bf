/**
 * The main job as others on the network do it: on plain http at a name of the network, where a
 * browser offers no secure context; and once under TLS.
 */

import { type Browser, expect, type Page, test } from "@playwright/test";
import { add, card, saved, start } from "./canvas";
import { LONG, type Person, Product, TOKEN } from "./product";

const LAB = "lab.test";

/** A picture for who looks, when a folder for them is named. */
async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env.LAN_PICTURES;
  if (folder !== undefined) await page.screenshot({ path: `${folder}/${name}.png` });
}

interface Invitation {
  id: string;
  path: string;
}

/** A link of a role. */
function invite(product: Product, role: string): Promise<Invitation> {
  return product.ask<Invitation>("/api/invitations", {
    method: "POST",
    body: JSON.stringify({ role }),
    headers: { "content-type": "application/json" },
  });
}

function lab(product: Product): string {
  return `${product.scheme}://${LAB}:${product.port}`;
}

/** Somebody opens a link on a computer of their own, and is asked for a name. */
async function arrive(
  product: Product,
  browser: Browser,
  link: string,
  name: string,
  options: Parameters<Browser["newContext"]>[0] = {},
): Promise<Person> {
  const context = await browser.newContext(options);
  const page = await context.newPage();
  const failures: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  await page.goto(lab(product) + link);
  await page.getByRole("textbox", { name: /others see you/ }).fill(name);
  await picture(page, `arrive-${name}`);
  await page.getByRole("button", { name: "Come in" }).click();
  await expect(page.getByRole("button", { name: /^Stop / })).toBeVisible();
  return { context, page, failures };
}

/** Opens a graph: a busy machine takes its time for the first sight of one. */
async function visit(page: Page, url: string): Promise<void> {
  await page.goto(url);
  await expect(card(page, "Wait")).toBeVisible({ timeout: 45_000 });
}

async function stateOf(product: Product, graph: string): Promise<string | undefined> {
  const runs = `/api/runs?graph=${graph}`;
  return (await product.ask<{ state: string }[]>(runs, {}, product.runnerUrl))[0]?.state;
}

/** The strip below the canvas says so, wherever the canvas looks. */
const goes = (page: Page) =>
  page.getByRole("region", { name: "Run" }).getByText("running", { exact: true }).first();

test.describe("on plain http", () => {
  const product = new Product(["--share", "--host", "127.0.0.1"], LAB);
  test.beforeAll(() => product.start());
  test.afterAll(() => product.dispose());

  test("an invited editor draws with the owner, offline too, exports, starts and stops", async ({
    browser,
  }) => {
    test.skip(LONG !== "", LONG);
    test.setTimeout(150_000);
    const ada = await product.person(browser, "Ada");
    // The owner makes the link in the page, and copies it without a clipboard of the browser's.
    await ada.page.goto(`${lab(product)}/#t=${TOKEN}`);
    await ada.page.getByRole("button", { name: "Share", exact: true }).click();
    const dialog = ada.page.getByRole("dialog", { name: "Share" });
    await expect(dialog.getByText("Not encrypted.")).toBeVisible();
    await dialog.getByRole("textbox", { name: "For whom" }).fill("Mari");
    await dialog.getByRole("button", { name: "New link" }).click();
    await dialog.getByRole("button", { name: "Copy: the link for Mari" }).click();
    await expect(dialog.getByRole("button", { name: "Copied: the link for Mari" })).toBeVisible();
    const link = await dialog.getByRole("textbox", { name: "Link for Mari" }).inputValue();
    await dialog.getByRole("textbox", { name: "For whom" }).press("ControlOrMeta+v");
    await expect(dialog.getByRole("textbox", { name: "For whom" })).toHaveValue(link.slice(0, 60));
    await dialog.getByRole("button", { name: "Code of the link for Mari" }).click();
    const code = dialog.getByRole("img", { name: "QR code of the link for Mari" });
    await expect.poll(() => code.evaluate((img: HTMLImageElement) => img.naturalWidth)).not.toBe(0);

    const mari = await arrive(product, browser, new URL(link).hash.replace(/^/, "/"), "Mari");
    expect(await mari.page.evaluate(() => window.isSecureContext)).toBe(false);
    expect(mari.page.url()).not.toContain("#");
    await expect(dialog.getByText("Mari came in")).toBeVisible();
    await picture(ada.page, "share-light");
    await ada.page.emulateMedia({ colorScheme: "dark" });
    await picture(ada.page, "share-dark");
    await ada.page.setViewportSize({ width: 390, height: 844 });
    await picture(ada.page, "share-phone-dark");
    await ada.page.emulateMedia({ colorScheme: "light" });
    await picture(ada.page, "share-phone");
    await ada.page.setViewportSize({ width: 1440, height: 900 });
    await dialog.getByRole("button", { name: "Close" }).click();

    // Both draw one graph.
    const graph = await product.chain(60);
    await visit(mari.page, `${lab(product)}/graphs/${graph}`);
    await saved(mari.page);
    await add(mari.page, "Sooner");
    await visit(ada.page, mari.page.url());
    await expect(card(ada.page, "Sooner")).toBeVisible();
    await mari.context.setOffline(true);
    await add(mari.page, "Later");
    await expect(mari.page.getByText(/Offline with/).first()).toBeVisible({ timeout: 45_000 });
    await mari.context.setOffline(false);
    await saved(mari.page);
    await expect(card(ada.page, "Later")).toBeVisible();

    const [file] = await Promise.all([
      mari.page.waitForEvent("download"),
      mari.page.locator(".react-flow__pane").press("ControlOrMeta+s"),
    ]);
    expect(file.suggestedFilename()).toContain(".umrf.graph.json");

    await start(mari.page);
    await expect(goes(ada.page)).toBeVisible();
    await mari.page.getByRole("button", { name: /^Stop run/ }).click();
    await expect.poll(() => stateOf(product, graph)).toBe("stopped");
    expect([...ada.failures, ...mari.failures]).toEqual([]);
    await ada.context.close();
    await mari.context.close();
  });

  test("a viewer sees and stops, changes nothing, and is put out at once", async ({ browser }) => {
    test.setTimeout(120_000);
    const graph = await product.chain(70);
    const invitation = await invite(product, "viewer");
    const ada = await product.person(browser, "Ada");
    await visit(ada.page, `${product.url}/graphs/${graph}`);
    await saved(ada.page);
    const moment = async () => (await product.ask<{ seq: number }>(`/api/graphs/${graph}`)).seq;
    await expect.poll(moment).toBe(2); // its cards stood nowhere: Ada's page has placed them
    const { page, failures, context } = await arrive(product, browser, invitation.path, "Vic");
    await expect(page.getByRole("button", { name: "New graph" })).toHaveCount(0);
    await visit(page, `${lab(product)}/graphs/${graph}`);
    await expect(page.getByText("View only", { exact: true })).toBeVisible({ timeout: 40_000 });
    await expect(page.getByRole("button", { name: /^(Run|Start) v/ })).toHaveCount(0);
    await expect(page.getByRole("button", { name: /^Share/ })).toHaveCount(0);
    await expect(page.getByRole("button", { name: "Add an action" }).first()).toBeDisabled();

    await picture(page, "viewer");

    // Keys and the form change nothing, and no card can be dragged.
    const first = card(page, "Wait");
    await first.click({ position: { x: 50, y: 30 } });
    await page.keyboard.press("Delete");
    await page.keyboard.press("a");
    await expect(page.getByRole("combobox", { name: "Name of an action" })).toHaveCount(0);
    await expect(
      page.getByRole("textbox", { name: "Name", exact: true }).first(),
    ).not.toBeEditable();
    const panel = page.getByRole("tabpanel").first();
    await expect(panel.getByRole("button", { name: "Connect" })).toBeDisabled();
    await expect(panel.getByRole("checkbox", { name: /^The graph starts with/ })).toBeDisabled();
    await expect(panel.getByRole("button", { name: /^Delete the arrow/ })).toBeDisabled();
    // What only shows something works: go to an arrow and on to its end, unfold a parameter.
    await panel.getByRole("button", { name: /^true.*Wait 1$/ }).click();
    await expect(panel.getByRole("button", { name: "Delete this arrow" })).toBeDisabled();
    await panel.getByRole("button", { name: "Wait 1", exact: true }).click();
    await expect(card(page, "Wait", 1)).toHaveClass(/selected/);
    await page.getByRole("button", { name: "Unfold the list" }).click();
    await page.getByRole("link", { name: /^fetch_tool/ }).click();
    await card(page, "DriveTo")
      .first()
      .click({ position: { x: 50, y: 30 } });
    await panel
      .getByRole("button", { name: /^What the parameter/ })
      .first()
      .click();
    await expect(panel.getByRole("button", { name: /^Remove the parameter/ })).toBeDisabled();
    await expect(panel.getByRole("textbox", { name: "Name", exact: true }).last()).toBeVisible();
    await page.getByRole("link", { name: /^chain_70/ }).click();
    await expect(page.locator(".react-flow__node-action.draggable")).toHaveCount(0);
    expect(await moment()).toBe(2);

    // What the others start is seen, and stopped.
    await start(ada.page);
    await expect(page.getByRole("button", { name: /^Stop run/ })).toBeVisible();
    await ada.context.close();
    await page.getByRole("button", { name: /^Stop run/ }).click();
    await expect.poll(() => stateOf(product, graph)).toBe("stopped");

    await product.ask(`/api/invitations/${invitation.id}/revoke`, { method: "POST" });
    await expect(page.getByText(/Your link was revoked/)).toBeVisible({ timeout: 15_000 });
    await picture(page, "revoked");
    await expect(page.getByRole("button", { name: /^Stop/ })).toHaveCount(0);
    await page.goto(lab(product) + invitation.path);
    await expect(page.getByText(/revoked/)).toBeVisible();
    expect([...ada.failures, ...failures]).toEqual([]);
    await context.close();
  });
});

test.describe("under TLS", () => {
  const product = new Product(["--share", "--tls", "--host", "127.0.0.1"], LAB);
  test.beforeAll(async () => {
    process.env.NODE_TLS_REJECT_UNAUTHORIZED = "0"; // the requests of this test, on loopback
    await product.start();
  });
  test.afterAll(async () => {
    await product.dispose();
    delete process.env.NODE_TLS_REJECT_UNAUTHORIZED;
  });

  test("the page is a secure context, edits and Stop go encrypted", async ({ browser }) => {
    const graph = await product.chain(60);
    const invitation = await invite(product, "editor");
    const options = { ignoreHTTPSErrors: true };
    const mari = await arrive(product, browser, invitation.path, "Mari", options);
    expect(await mari.page.evaluate(() => window.isSecureContext)).toBe(true);
    const [cookie] = await mari.context.cookies();
    expect(cookie).toMatchObject({ secure: true, httpOnly: true, sameSite: "Strict" });
    await visit(mari.page, `${lab(product)}/graphs/${graph}`);
    await saved(mari.page);
    await add(mari.page, "More");
    await saved(mari.page);
    await start(mari.page);
    await mari.page.getByRole("button", { name: /^Stop run/ }).click();
    await expect.poll(() => stateOf(product, graph)).toBe("stopped");
    expect(mari.failures).toEqual([]);
    await mari.context.close();
  });
});
