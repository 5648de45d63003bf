/** Persons by personal links: invited, a device added, and put out everywhere at once. */
import { type Browser, expect, test } from "@playwright/test";
import { Product } from "./product";

const product = new Product();

test.beforeAll(() => product.start());
test.afterAll(() => product.dispose());

const PHONE = { width: 390, height: 844 };

async function newBrowser(browser: Browser, viewport?: { width: number; height: number }) {
  const context = await browser.newContext(viewport === undefined ? {} : { viewport });
  return { context, page: await context.newPage() };
}

test("a person is invited, adds a phone, and is put out on both at once", async ({ browser }) => {
  const owner = await product.person(browser, "Ada");
  await owner.page.goto(`${product.url}/people`);
  const persons = owner.page.getByRole("region", { name: "Persons" });
  await persons.getByLabel("Name", { exact: true }).fill("Mari");
  await persons.getByRole("button", { name: "Add", exact: true }).click();
  const link = await persons.getByLabel(/^Link for .*Mari/).inputValue();

  // The link says for whom it is, and lets one browser in.
  const mari = await newBrowser(browser);
  await mari.page.goto(link);
  await mari.page.getByRole("button", { name: /^Come in as .*Mari/ }).click();
  await expect(mari.page.getByRole("button", { name: /^You are .*Mari/ })).toBeVisible();
  await mari.page.goto(`${product.url}/people`);
  await expect(mari.page.getByText("this one")).toBeVisible();
  await expect(persons.getByText("1 device")).toBeVisible({ timeout: 10_000 });

  // Her phone sends the code that this page shows; both show one number.
  await mari.page.getByRole("button", { name: "Add a device" }).click();
  const code = await mari.page.getByLabel("Code", { exact: true }).textContent();
  const phone = await newBrowser(browser, PHONE);
  await phone.page.goto(`${product.url}/#d=${code}`);
  await phone.page.getByRole("button", { name: "Sign in" }).click();
  const number = await phone.page.getByRole("status").locator("b").textContent();
  const asking = mari.page.getByRole("alert").filter({ hasText: "wants to come in as you" });
  await expect(asking).toContainText(number ?? "?");
  await asking.getByRole("button", { name: "Yes, it is mine" }).click();
  await expect(phone.page.getByText("valve_inspection").first()).toBeVisible();
  await expect(persons.getByText("2 devices")).toBeVisible({ timeout: 10_000 });

  // The owner ends her: the server knows neither browser any more.
  await persons.getByRole("button", { name: /^More about .*Mari/ }).click();
  await persons.getByRole("button", { name: /^End .*Mari/ }).click();
  await persons.getByRole("button", { name: "End now" }).click();
  await expect(persons.getByText(/^Ended: .*Mari/)).toBeVisible();
  for (const { context } of [mari, phone]) {
    const answer = await context.request.get(`${product.url}/api/graphs`);
    expect([answer.status(), (await answer.json()).type]).toEqual([401, "withdrawn"]);
  }
  for (const { page, context } of [mari, phone]) {
    await expect(page.getByText("an owner ended your access")).toBeVisible({ timeout: 15_000 });
    await context.close();
  }
  expect(owner.failures).toEqual([]);
  await owner.context.close();
});
