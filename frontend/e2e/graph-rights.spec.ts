/** Rights on graphs: an owner says in a dialog who may see one and who may edit it. */
import { expect, test } from "@playwright/test";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

test("a graph is hidden from a person, then shown to look at, by the keyboard", async ({
  browser,
}) => {
  const owner = await product.person(browser, "Ada");
  const post = async (path: string, data: unknown) => {
    const headers = { origin: product.url };
    const answer = await owner.context.request.post(product.url + path, { data, headers });
    expect(answer.status(), await answer.text()).toBe(201);
    return answer.json();
  };
  const member = await post("/api/members", { name: "Mari", role: "editor", groups: [] });
  const graph = await post("/api/graphs", { name: "Secret errand" });
  const mari = await browser.newContext({ viewport: { width: 390, height: 844 } });
  const page = await mari.newPage();
  await page.goto(product.url + member.links[0].path);
  await page.getByRole("button", { name: /^Come in as .*Mari/ }).click();
  await expect(page.getByRole("button", { name: /^You are .*Mari/ })).toBeVisible();
  await page.goto(`${product.url}/graphs/${graph.id}`);
  await expect(page.getByText("Saved")).toBeVisible();

  // The owner chooses nobody: Mari is put out at once, and the dialog says so in words.
  await owner.page.goto(product.url);
  const more = owner.page.getByRole("button", { name: /^More about .*Secret errand/ });
  await more.press("Enter");
  await owner.page.getByRole("menuitem", { name: "Who may see and edit it …" }).press("Enter");
  const dialog = owner.page.getByRole("dialog", { name: /^Who may see and edit .*Secret errand/ });
  await expect(dialog.getByText("Everybody may see and edit it.")).toBeVisible();
  const seeing = dialog.getByRole("radiogroup", { name: "Who may see it" });
  await seeing.getByRole("radio", { name: "Everybody" }).press("ArrowRight");
  await expect(dialog.getByText("Only owners may see it.")).toBeVisible();
  // What the runner did not hear of can be saved again as it is.
  await owner.page.route(`${product.runnerUrl}/api/graph-rules`, (route) => route.abort());
  await dialog.getByRole("button", { name: "Save" }).press("Enter");
  await expect(dialog.getByRole("alert")).toContainText("Done at the editor.");
  await expect(dialog.getByText("Only owners may see it.")).toBeVisible();
  await owner.page.unroute(`${product.runnerUrl}/api/graph-rules`);
  await dialog.getByRole("button", { name: "Save" }).press("Enter");
  await expect(dialog).toBeHidden();
  await expect(page.getByText("Saved")).toBeHidden();
  await page.goto(product.url);
  await expect(page.getByText("valve_inspection").first()).toBeVisible();
  await expect(page.getByText("Secret errand")).toBeHidden();

  // Then Mari may look at it.
  await expect(owner.page.getByText("Not everybody may see or edit this").first()).toBeAttached();
  await more.press("Enter");
  await owner.page.getByRole("menuitem", { name: "Who may see and edit it …" }).press("Enter");
  const readers = dialog.getByRole("combobox", { name: "Who may see it: persons and groups" });
  await readers.fill("Mari");
  await readers.press("ArrowDown");
  await readers.press("Enter");
  await readers.press("Escape");
  const editing = dialog.getByRole("radiogroup", { name: "Who may edit it" });
  await editing.getByRole("radio", { name: "All who may see" }).press("ArrowRight");
  await expect(
    dialog.getByText(/^Only .*Mari.* may see it\. Only owners may edit it\.$/),
  ).toBeVisible();
  await dialog.getByRole("button", { name: "Save" }).press("Enter");
  await expect(dialog).toBeHidden();
  await page.goto(`${product.url}/graphs/${graph.id}`);
  await expect(page.getByText("You may look at this graph, and not change it.")).toBeVisible();
  await mari.close();
  expect(owner.failures).toEqual([]);
  await owner.context.close();
});

test("of a run of a hidden graph a person sees where, its state, who started it, and stops it", async ({
  browser,
}) => {
  const send = <T>(path: string, body: unknown, method = "POST", base = product.url) => {
    const headers = { "content-type": "application/json" };
    return product.ask<T>(path, { method, body: JSON.stringify(body), headers }, base);
  };
  const graph = await product.chain(40);
  const { id } = await send<{ id: string }>(`/api/graphs/${graph}/versions`, {});
  await send(`/api/graphs/${graph}/rule`, { rule: { readers: [], editors: [] } }, "PUT");
  const { digest, umrf } = await product.ask<{ digest: string; umrf: object }>(
    `/api/versions/${id}`,
  );
  const sight = await product.ask(`/api/versions/${id}/sight`);
  const start = { version: id, digest, umrf, graph, sight, engine: "simulator", request_id: "r" };
  const run = await send<{ id: string }>("/api/runs", start, "POST", product.runnerUrl);
  const nora = { name: "Nora", role: "viewer" };
  const { links } = await send<{ links: { path: string }[] }>("/api/members", nora);

  const context = await browser.newContext({ viewport: { width: 390, height: 844 } });
  const page = await context.newPage();
  await page.goto(product.url + links[0]?.path);
  await page.getByRole("button", { name: /^Come in as .*Nora/ }).click();
  await expect(page.getByRole("button", { name: /^You are .*Nora/ })).toBeVisible();
  await page.goto(`${product.url}/runs/${run.id}`);
  const card = page.getByRole("region", { name: /^Run \d/ });
  await expect(card).toContainText("A run of a graph that you may not see");
  await expect(card).toContainText(/Running.*Simulator/i);
  await expect(card).toContainText("Started by");
  expect(await page.content()).not.toMatch(/chain_40|Wait_\d/);
  await card.getByRole("button", { name: /^Stop/ }).click();
  await expect(card).toContainText("proved at");
  await expect(card).toContainText("Stopped by");
  expect(await page.content()).not.toMatch(/chain_40|Wait_\d/);
  await context.close();
});
