/** A program is let in by a code, named in its runs, and shut out; tokens are made, shown once, revoked. */

import { execFile, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { promisify } from "node:util";
import { expect, test } from "@playwright/test";
import { LONG, Product } from "./product";
import { violations } from "./valves";

const product = new Product();
const home = mkdtempSync(join(tmpdir(), "action-assistant-home-"));
const COMMAND = resolve(import.meta.dirname, "../../.venv/bin/action-assistant");
const PICTURES = process.env.PICTURES_OF_PROGRAMS;

test.beforeAll(() => product.start());
test.afterAll(async () => {
  await product.dispose();
  rmSync(home, { recursive: true, force: true });
});

/** The environment of somebody at another computer, without the token of the server. */
const elsewhere = () => ({
  PATH: process.env.PATH,
  HOME: home,
  ACTION_ASSISTANT_URL: product.url,
});

test("a person lets the command line in by a code, sees its run, and shuts it out", async ({
  browser,
}) => {
  test.skip(LONG !== "", LONG);
  const { page, failures } = await product.person(browser, "Ada");
  const login = spawn(
    COMMAND,
    ["login", product.url, "--name", "laptop", "--scope", "edit", "--scope", "operate"],
    { env: elsewhere() },
  );
  const ended = new Promise<number | null>((done) => login.once("exit", done));
  const code = await new Promise<string>((done) => {
    login.stdout.on("data", (said: Buffer) => {
      const found = /^Code: (\S+)$/m.exec(said.toString());
      if (found?.[1]) done(found[1]);
    });
  });

  await page.getByRole("button", { name: /^You are Ada/ }).click();
  await page.getByRole("link", { name: "Programs" }).click();
  const card = page.getByRole("region", { name: "Sign a program in" });
  await card.getByLabel(/^The code/).fill("BBBB-BBBB");
  await card.getByRole("button", { name: "Look" }).click();
  await expect(card).toContainText("No program waits with this code.");
  await card.getByLabel(/^The code/).fill(code.toLowerCase());
  await card.getByRole("button", { name: "Look" }).click();
  const question = card.getByRole("form", { name: "Program that asks" });
  await expect(question).toContainText(`laptop asks from the server’s own computer`);
  // Nobody is talked into robots: it is never ticked beforehand.
  const operate = question.getByRole("checkbox", { name: /operate$/ });
  await expect(operate).not.toBeChecked();
  await expect(question.getByRole("note")).toBeHidden();
  await operate.check();
  await expect(question.getByRole("note")).toContainText("Real robots move");
  expect(await violations(page)).toEqual([]);
  if (PICTURES) await page.screenshot({ path: `${PICTURES}/asks.png`, fullPage: true });
  await question.getByRole("button", { name: "Let it in" }).click();
  await expect(card.getByRole("status")).toContainText("laptop is signed in.");
  expect(await ended).toBe(0);
  const tokens = page.getByRole("region", { name: "Tokens", exact: true });
  await expect(tokens.getByRole("listitem")).toContainText("laptop");
  await expect(tokens.getByRole("listitem")).toContainText("edit, operate, read, simulate");

  const cli = promisify(execFile);
  const run = await cli(COMMAND, ["run", "valve_inspection", "--no-wait"], { env: elsewhere() });
  await page.goto(`${product.url}/runs/${run.stdout.trim()}`);
  await expect(page.getByText("by program laptop").first()).toBeVisible();

  await page.goto(`${product.url}/programs`);
  await tokens.getByRole("button", { name: "Revoke the token laptop" }).click();
  await tokens.getByRole("button", { name: "Revoke now" }).click();
  await expect(tokens).toContainText("No program has a token yet.");
  await expect(cli(COMMAND, ["graphs"], { env: elsewhere() })).rejects.toThrow(/was revoked/);
  expect(failures).toEqual([]);
});

test("a token is shown once, and fits on a phone", async ({ browser }) => {
  const { page } = await product.person(browser, "Eve");
  await page.goto(`${product.url}/programs`);
  const form = page.getByRole("form", { name: "New token" });
  await form.getByLabel("Name of the program").fill("nightly");
  await form.getByRole("checkbox", { name: /simulate$/ }).check();
  await form.getByRole("button", { name: "Make the token" }).click();
  const shown = page.getByLabel("Token of nightly");
  await expect(shown).toHaveValue(/^aat_\w{12}_\w{43}_\w{6}$/);
  const text = await shown.inputValue();
  if (PICTURES) await page.screenshot({ path: `${PICTURES}/made.png`, fullPage: true });
  const headers = { authorization: `Bearer ${text}` };
  for (const place of [`${product.url}/api/graphs`, `${product.runnerUrl}/api/runs`]) {
    expect((await fetch(place, { headers })).status).toBe(200);
  }
  await page.getByRole("button", { name: "I have it" }).click();
  await expect(form).toBeVisible();
  expect(await page.content()).not.toContain(text);
  await page.setViewportSize({ width: 390, height: 844 });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  expect(wide).toBeLessThanOrEqual(390);
  await page.emulateMedia({ colorScheme: "dark" });
  expect(await violations(page)).toEqual([]);
  if (PICTURES) await page.screenshot({ path: `${PICTURES}/phone.png`, fullPage: true });
});
