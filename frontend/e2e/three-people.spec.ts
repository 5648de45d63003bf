/** A lab opens its door: an owner, a person by a personal link with a phone, and one by the provider of the
 * institution, from the invitation to the end. `WALK_PICTURES`: a folder for pictures of each step. */

import { type BrowserContext, expect, type Page, test } from "@playwright/test";
import { IdentityProvider } from "./identity-provider";
import { LONG, type Person, Product } from "./product";

test.skip(LONG !== "", LONG);
test.describe.configure({ mode: "serial" });

const provider = new IdentityProvider();
const failures: string[] = [];
let product: Product;
let ada: Person;
let mari: { context: BrowserContext; page: Page };
let phone: { context: BrowserContext; page: Page };
let jan: { context: BrowserContext; page: Page };

const robot = (page: Page) => page.getByRole("article", { name: "David" });
const persons = () => ada.page.getByRole("region", { name: "Persons" });

async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env.WALK_PICTURES;
  if (folder) await page.screenshot({ path: `${folder}/${name}.png` });
}

/** Send something as the owner's program. */
function send<T>(path: string, body: unknown, method = "POST", base = product.url): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method, body: JSON.stringify(body), headers }, base);
}

/** Return when the page has put its person out; polling as `expect` does would add up to a second. */
function putOutAt(): Promise<number> {
  return new Promise((done) => {
    const look = () => {
      if (!document.body.textContent?.includes("an owner ended your access")) return;
      observer.disconnect();
      done(Date.now());
    };
    const observer = new MutationObserver(look);
    observer.observe(document.body, { subtree: true, childList: true });
    look();
  });
}

function setRights(operators: unknown): Promise<unknown> {
  const rights = { operators, baton: true };
  return send("/api/robots/David/rights", rights, "PUT", product.runnerUrl);
}

test.beforeAll(async ({ browser }) => {
  await provider.listen();
  product = new Product([], "", provider.settings);
  await product.start();
  provider.serve([product.url]);
  await send("/api/robots", { name: "David" }, "POST", product.runnerUrl);
  ada = await product.person(browser, "Ada");
  const desk = { width: 1280, height: 800 };
  const opened = async (viewport: { width: number; height: number }) => {
    const context = await browser.newContext({ viewport });
    const page = await context.newPage();
    page.on("pageerror", (error) => failures.push(error.message));
    return { context, page };
  };
  mari = await opened(desk);
  phone = await opened({ width: 390, height: 844 });
  jan = await opened(desk);
});

test.afterAll(async () => {
  expect([...failures, ...ada.failures]).toEqual([]);
  for (const { context } of [mari, phone, jan]) await context.close();
  await product.dispose();
  await provider.close();
});

test("a person comes by a personal link and adds a phone, another by the provider", async () => {
  await ada.page.goto(`${product.url}/people`);
  await persons().getByLabel("Name", { exact: true }).fill("Mari");
  await persons().getByRole("combobox", { name: "Role" }).selectOption("operator");
  await persons().getByRole("button", { name: "Add", exact: true }).click();
  const link = await persons()
    .getByLabel(/^Link for .*Mari/)
    .inputValue();
  await picture(ada.page, "1-invited");
  await mari.page.goto(link);
  await picture(mari.page, "2-link");
  await mari.page.getByRole("button", { name: /^Come in as .*Mari/ }).click();
  await expect(mari.page.getByRole("button", { name: /^You are .*Mari/ })).toBeVisible();

  await mari.page.goto(`${product.url}/people`);
  await mari.page.getByRole("button", { name: "Add a device" }).click();
  const code = await mari.page.getByLabel("Code", { exact: true }).textContent();
  await phone.page.goto(`${product.url}/#d=${code}`);
  await phone.page.getByRole("button", { name: "Sign in" }).click();
  const asking = mari.page.getByRole("alert").filter({ hasText: "wants to come in as you" });
  const number = await phone.page.getByRole("status").locator("b").textContent();
  await expect(asking).toContainText(number ?? "?");
  await picture(mari.page, "3-device-asks");
  await picture(phone.page, "4-device-waits");
  await asking.getByRole("button", { name: "Yes, it is mine" }).click();
  await expect(phone.page.getByText("valve_inspection").first()).toBeVisible();

  provider.groups.set("jan", ["lab"]);
  await jan.page.goto(`${product.url}/robots`);
  await jan.page.getByRole("button", { name: "Sign in with Lab login" }).click();
  await jan.page.getByPlaceholder("Enter any login").fill("jan");
  await jan.page.getByPlaceholder("and password").fill("any");
  await jan.page.getByRole("button", { name: "Sign-in" }).click();
  await jan.page.getByRole("button", { name: "Continue" }).click();
  await expect(jan.page.getByRole("button", { name: /^You are .*jan/ })).toBeVisible();
});

test("a robot refuses with a sentence, and its baton goes from one to the other", async () => {
  const { people } = await product.ask<{ people: { id: string; name: string }[] }>("/api/members");
  const [listed] = people.filter(({ name }) => name === "Mari");
  await setRights([{ id: listed?.id, name: "Mari" }]);
  for (const { page } of [mari, phone, jan]) await page.goto(`${product.url}/robots`);
  await expect(robot(jan.page)).toContainText("You may not start on David: only Mari may.");
  await picture(jan.page, "5-refused");

  await setRights("all");
  await robot(mari.page).getByRole("button", { name: "Take the baton" }).click();
  await expect(robot(mari.page)).toContainText("You have its baton");
  await expect(robot(phone.page)).toContainText("You have its baton"); // the same person
  await expect(robot(jan.page)).toContainText("You may not start on David: Mari has its baton.");
  await picture(phone.page, "6-baton-on-the-phone");
  await robot(mari.page).getByRole("button", { name: "Hand over …" }).click();
  await mari.page.getByRole("menuitem", { name: /^To jan/ }).click();
  await expect(robot(jan.page)).toContainText("You have its baton");
  await expect(robot(phone.page)).toContainText("jan has its baton");
  await picture(jan.page, "7-baton-handed-over");
});

test("of a run that they may not see both stop what they cannot look at", async () => {
  const graph = await product.chain(40);
  const { id } = await send<{ id: string }>(`/api/graphs/${graph}/versions`, {});
  const { digest, umrf } = await product.ask<{ digest: string; umrf: object }>(
    `/api/versions/${id}`,
  );
  const rule = { rule: { readers: [], editors: [] } };
  await send(`/api/graphs/${graph}/rule`, rule, "PUT");
  const sight = await product.ask(`/api/versions/${id}/sight`);
  for (const [name, { page }] of Object.entries({ desk: mari, phone })) {
    const start = { version: id, digest, umrf, graph, sight, engine: "simulator" };
    const order = { ...start, request_id: name };
    const run = await send<{ id: string }>("/api/runs", order, "POST", product.runnerUrl);
    await page.goto(`${product.url}/runs/${run.id}`);
    const card = page.getByRole("region", { name: /^Run \d/ });
    await expect(card).toContainText("A run of a graph that you may not see");
    await expect(card).toContainText(/Running.*Simulator/i);
    await expect(card).toContainText("Started by");
    await expect(page.getByText("chain_40")).toHaveCount(0);
    await picture(page, `8-hidden-${name}`);
    await card.getByRole("button", { name: /^Stop/ }).click();
    await expect(card).toContainText("proved at");
    await expect(card).toContainText("Stopped by");
    await picture(page, `9-hidden-stopped-${name}`);
  }
});

test("who is ended is put out on both browsers, and the baton and the others stay", async () => {
  await persons()
    .getByRole("button", { name: /^More about .*Mari/ })
    .click();
  await persons()
    .getByRole("button", { name: /^End .*Mari/ })
    .click();
  const seen = [mari, phone].map(({ page }) => page.evaluate(putOutAt));
  const asked = ada.page.waitForRequest(/\/api\/members\/.*\/end$/).then(() => Date.now());
  await persons().getByRole("button", { name: "End now" }).click();
  const begun = await asked;
  for (const at of await Promise.all(seen)) {
    process.stdout.write(`put out after ${at - begun} ms\n`);
  }
  for (const { context } of [mari, phone]) {
    const answer = await context.request.get(`${product.url}/api/graphs`);
    expect([answer.status(), (await answer.json()).type]).toEqual([401, "withdrawn"]);
  }
  await picture(phone.page, "10-put-out");
  await expect(robot(jan.page)).toContainText("You have its baton");
  await picture(ada.page, "11-owner-afterwards");
});
