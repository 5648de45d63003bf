/** A led run that was stopped is continued where it ended, and another one begins in the middle. */

import { expect, type Page, test } from "@playwright/test";
import { card, holdEnter, saved } from "./canvas";
import { type Person, Product } from "./product";

const product = new Product();
let ada: Person;

test.beforeAll(async ({ browser }) => {
  await product.start();
  ada = await product.person(browser, "Ada");
});
test.afterAll(async () => {
  expect(ada.failures).toEqual([]);
  await product.dispose();
});

interface Listed {
  id: string;
  number: number;
  state: string;
  from?: { run?: string; at?: string[] };
}

const dialog = (page: Page) => page.getByRole("dialog");
const NO_RUN: Listed = { id: "", number: 0, state: "" };
const newest = async () =>
  (await product.ask<Listed[]>("/api/runs", {}, product.runnerUrl))[0] ?? NO_RUN;
const posted = <T>(path: string, body: unknown, url = product.url) =>
  product.ask<T>(
    path,
    {
      method: "POST",
      body: JSON.stringify(body),
      headers: { "content-type": "application/json" },
    },
    url,
  );

/** Return the id of a graph of three actions, whose led run was stopped in the second one. */
async function stopped(): Promise<string> {
  const names = ["Drive", "Grip", "Lift"].map((name) => ({ name, instance_id: 0 }));
  const actions = names.map((each, i) => ({
    ...{ ...each, type: "sync" },
    ...{ parents: names.slice(Math.max(0, i - 1), i), children: names.slice(i + 1, i + 2) },
  }));
  const ends = { graph_entry: names.slice(0, 1), graph_exit: names.slice(2) };
  const { id } = await posted<{ id: string }>("/api/graphs", {
    graph_name: "line",
    ...ends,
    actions,
  });
  const version = await posted<{ id: string; digest: string; umrf: unknown }>(
    `/api/graphs/${id}/versions`,
    {},
  );
  const order = {
    ...{ version: version.id, digest: version.digest, umrf: version.umrf, graph: id },
    ...{ engine: "conducted", robots: { "": "simulator" }, request_id: `first ${id}` },
    script: { behaviours: { Drive: [{ after_s: 0.1 }], Grip: [{ never: true }] } },
  };
  const run = await posted<Listed>("/api/runs", order, product.runnerUrl);
  const grips = async () => {
    const path = `/api/runs/${run.id}`;
    const whole = await product.ask<{ actions: { Grip_0: { state: string } } }>(
      path,
      {},
      product.runnerUrl,
    );
    return whole.actions.Grip_0.state;
  };
  await expect.poll(grips).toBe("RUNNING");
  await posted(`/api/runs/${run.id}/stop`, {}, product.runnerUrl);
  await expect.poll(async () => (await newest()).state).toBe("stopped");
  return id;
}

test("a person chooses what becomes of an action that was under way, and the run goes on from there", async () => {
  const { page } = ada;
  const graph = await stopped();
  const first = await newest();
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await page.getByRole("button", { name: "Continue …" }).click();
  const start = dialog(page).getByRole("button", { name: /^Run v\d+/ });
  await expect(start).toHaveText(/Choose for Grip/);
  await expect(start).toBeDisabled();
  const question = dialog(page).getByRole("group", { name: /Grip on the simulator had begun/ });
  await expect(question.getByRole("radio", { checked: true })).toHaveCount(0);
  await expect(dialog(page)).toContainText(/Drive: true, .* ago/);
  await question.getByRole("radio", { name: "Done, with true" }).check();
  await expect(start).toHaveText(/Say how you know it/);
  await dialog(page)
    .getByLabel(/How do you know/)
    .fill("It holds the cup.");
  await expect(start).toBeEnabled();
  await expect(dialog(page)).toContainText("Lift_0 begins first");
  await holdEnter(page, start);
  await expect.poll(async () => (await newest()).state).toBe("finished");
  const { id, from } = await newest();
  expect(from?.run).toBe(first.id);
  const whole = await product.ask<{
    earlier: unknown;
    actions: Record<string, { count?: number }>;
  }>(`/api/runs/${id}`, {}, product.runnerUrl);
  expect(whole.earlier).toMatchObject({
    choices: { Grip_0: "true" },
    reason: "It holds the cup.",
  });
  expect(Object.entries(whole.actions).filter(([, { count = 0 }]) => count > 0)).toHaveLength(1);
  await expect(page.getByText(`continues run ${first.number}`, { exact: false })).toBeVisible();

  await card(page, "Lift").click({ position: { x: 40, y: 24 } });
  await page.keyboard.press("Control+k");
  await page.keyboard.type("Run from here");
  await page.keyboard.press("Enter");
  await expect(dialog(page)).toContainText("Run from Lift");
  await expect(dialog(page)).toContainText("Skipped");
  await expect(start).toBeEnabled();
  await holdEnter(page, start);
  await expect.poll(async () => (await newest()).from?.at).toEqual(["Lift_0"]);
  await expect.poll(async () => (await newest()).state).toBe("finished");
});
