/** An action from nothing to C++ that compiles: described, drawn with, tried in Python, downloaded, built. */

import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { expect, type Page, test } from "@playwright/test";
import { card, saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { LONG, Product } from "./product";

const STUBS = resolve(import.meta.dirname, "../../tests/umrf/packages/stubs");
const folder = mkdtempSync(join(tmpdir(), "first-action-"));
const product = new Product(["--behaviours", folder]);

test.beforeAll(() => product.start());
test.afterAll(async () => {
  await product.dispose();
  rmSync(folder, { recursive: true });
});

/** The first of the page's files, unpacked. */
async function unpacked(page: Page, press: () => Promise<void>): Promise<string> {
  const download = page.waitForEvent("download");
  await press();
  const into = join(folder, "unpacked");
  execFileSync("python3", ["-m", "zipfile", "-e", await (await download).path(), into]);
  return into;
}

async function addParameter(page: Page, name: string, type: string): Promise<void> {
  await page.getByRole("button", { name: "Add", exact: true }).first().click();
  await page.getByRole("combobox", { name: "Name of the parameter" }).fill(name);
  await page.keyboard.press("Escape");
  await page.getByRole("combobox", { name: "Type of the parameter" }).click();
  await page.getByRole("option", { name: type, exact: true }).click();
  await page.locator("form").getByRole("button", { name: "Add", exact: true }).click();
}

test("an action with a pose goes from nothing to a package that compiles", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const { page, context, failures } = await product.person(browser, "Ada");
  await page.goto(`${product.url}/actions`);
  await page.getByRole("button", { name: "New action" }).click();
  await page.getByRole("textbox", { name: "Name" }).fill("GripPallet");
  await page.keyboard.press("Enter");
  await addParameter(page, "grip", "pose");
  await saved(page);
  const library = page.url();

  const end = { name: "Wait", instance_id: 0 };
  const { id } = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({
      ...{ graph_name: "lifting", graph_entry: [end], graph_exit: [] },
      actions: [{ ...end, type: "sync" }],
    }),
  });
  await page.goto(`${product.url}/graphs/${id}`);
  await saved(page);
  const lists = page.getByRole("complementary", { name: "Library" });
  await lists.getByText("Actions", { exact: true }).click();
  await lists.getByRole("button", { name: /^GripPallet/ }).click();
  await expect(card(page, "GripPallet")).toBeVisible();
  await saved(page);
  const drawn = await product.ask<{ actions: object[] }>(`/api/graphs/${id}/umrf`);
  expect(JSON.stringify(drawn.actions)).toContain('"position":{"x":');

  // It runs alone, with all that its behaviour is given.
  writeFileSync(
    join(folder, "grip_pallet.py"),
    "def run(action):\n    action.message('gripped')\n    return action.sleep(0.2)\n",
  );
  const values = (kind: string) => ({ pvf_type: kind, pvf_value: 0.5 });
  const xyz = { x: values("number"), y: values("number"), z: values("number") };
  const alone = { name: "GripPallet", instance_id: 0 };
  const tried = await product.ask<{ id: string }>("/api/graphs", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify({
      ...{ graph_name: "try_it", graph_entry: [alone], graph_exit: [alone] },
      actions: [{ ...alone, type: "sync", input_parameters: { grip: { position: xyz } } }],
    }),
  });
  await page.goto(`${product.url}/graphs/${tried.id}`);
  await saved(page);
  await page.getByRole("button", { name: "Choose where to start" }).click();
  const dialog = page.getByRole("dialog", { name: /^Start v1/ });
  await dialog.getByRole("radio", { name: /^Python behaviours/ }).check();
  await dialog.getByRole("button", { name: "Run v1 in the simulator" }).focus();
  await page.keyboard.down("Enter");
  await expect(dialog).toBeHidden();
  await page.keyboard.up("Enter");
  await expect(card(page, "GripPallet").getByText("true")).toBeVisible({ timeout: 15_000 });

  await page.goto(library);
  const download = page.getByRole("link", { name: "Download grip_pallet" });
  const made = join(await unpacked(page, () => download.click()), "grip_pallet");
  const strict = ["-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror"];
  const where = [`-I${made}/include`, `-I${STUBS}`];
  execFileSync("g++", [...strict, ...where, `${made}/test/grip_pallet_test.cpp`]);
  expect(failures).toEqual([]);
  await context.close();
});

test("an action that only a robot has is taken over from it", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  test.skip(NO_ROS !== "", NO_ROS);
  const index = join(folder, "index", "share");
  mkdirSync(index, { recursive: true });
  const takes = { seam: { start: { pvf_type: "number" } } };
  const file = { name: "WeldSeam", type: "sync", description: "Welds.", input_parameters: takes };
  writeFileSync(join(index, "weld_seam.umrf.json"), JSON.stringify(file));
  const atlas = new StandIn("Atlas", join(folder, "index"));
  try {
    atlas.start(product.data, {});
    await product.ask(
      "/api/robots",
      {
        method: "POST",
        headers: { "content-type": "application/json" },
        body: JSON.stringify({ name: "Atlas", domain: DOMAIN, get_service: atlas.path }),
      },
      product.runnerUrl,
    );
    const known = () =>
      product.ask<{ actions: { name: string }[] }>(
        "/api/robots/Atlas/known",
        {},
        product.runnerUrl,
      );
    await expect.poll(async () => (await known()).actions.length, { timeout: 30_000 }).toBe(1);

    const { page, context, failures } = await product.person(browser, "Ada");
    await page.goto(`${product.url}/actions`);
    await page.getByText("On Atlas", { exact: true }).click();
    await page
      .getByRole("navigation", { name: "Actions" })
      .getByRole("link", { name: /WeldSeam/ })
      .click();
    await page.getByRole("button", { name: /^(Take over|Add to the library)/ }).click();
    await saved(page);
    await expect(page.getByRole("row", { name: /seam/ })).toBeVisible();
    const listed = await product.ask<{ name: string; document: string | null }[]>("/api/actions");
    const document = listed.find(({ name }) => name === "WeldSeam")?.document;
    const taken = await product.ask<object>(`/api/actions/${document}/umrf`);
    expect(taken).toMatchObject(file);
    expect(failures).toEqual([]);
    await context.close();
  } finally {
    await atlas.kill();
  }
});
