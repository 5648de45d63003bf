/** Sign-in by a real OpenID Connect provider on another site, and back to where the person wanted to go. */
import { expect, type Page, test } from "@playwright/test";
import { IdentityProvider } from "./identity-provider";
import { Product } from "./product";

const provider = new IdentityProvider();
let product: Product;

test.beforeAll(async () => {
  await provider.listen();
  product = new Product([], "", provider.settings);
  await product.start();
  provider.serve([product.url]);
});
test.afterAll(async () => {
  await product.dispose();
  await provider.close();
});

/** Fill in the pages of the provider. */
async function logIn(page: Page, login: string, consents = true) {
  await page.getByPlaceholder("Enter any login").fill(login);
  await page.getByPlaceholder("and password").fill("any");
  await page.getByRole("button", { name: "Sign-in" }).click();
  if (consents) await page.getByRole("button", { name: "Continue" }).click();
}

test("a person signs in by the provider, and proves again that it is they", async ({ browser }) => {
  provider.groups.set("mari", ["lab"]);
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(`${product.url}/robots?from=there#place`);
  await expect(page.getByText("Signing out here leaves you signed in there.")).toBeVisible();
  await page.getByRole("button", { name: "Sign in with Lab login" }).click();
  await expect(page).toHaveURL(new RegExp(`^${provider.issuer}/`));
  await logIn(page, "mari");

  // Another site has sent the browser back; the strict cookie counts from the first page on.
  await expect(page).toHaveURL(`${product.url}/robots?from=there#place`);
  await expect(page.getByRole("button", { name: /^You are .*mari/ })).toBeVisible();
  await expect(page.getByRole("button", { name: /^Stop everything/ })).toBeVisible();
  const cookies = await context.cookies(product.url);
  expect(cookies.map(({ name, sameSite }) => [name, sameSite]).sort()).toEqual([
    [`aa_${product.port}`, "Strict"],
    [`aa_${product.port}_device`, "Strict"],
  ]);
  await page.reload();
  await expect(page.getByRole("button", { name: /^You are .*mari/ })).toBeVisible();

  // The proof: the provider asks although it knows her, and only she counts.
  const stop = page.getByRole("button", { name: /^Stop everything/ });
  await page.goto(`${product.url}/signed-in?again`);
  await expect(page.getByRole("heading", { name: "Confirm that it is you" })).toBeVisible();
  await expect(stop).toBeVisible();
  await page.getByRole("button", { name: "Confirm with Lab login" }).click();
  await logIn(page, "mari", false);
  await expect(page.getByText("It is confirmed that it is you")).toBeVisible();
  await expect(stop).toBeVisible();

  // Also where a link that is refused is opened, and this browser remembers nobody.
  await page.evaluate(() => localStorage.clear());
  await page.goto(`${product.url}/#t=of-another-server`);
  await page.reload();
  await expect(stop).toBeVisible();
  await page.goto(`${product.url}/signed-in?again`);
  await page.getByRole("button", { name: "Confirm with Lab login" }).click();
  await page.getByRole("link", { name: "[ Cancel ]" }).click();
  await expect(page.getByRole("alert")).toContainText("Nobody was signed in: Lab login says");
  await context.close();
});

test("whom no group lets in is told at the button", async ({ browser }) => {
  const context = await browser.newContext();
  const page = await context.newPage();
  await page.goto(product.url);
  await page.getByRole("button", { name: "Sign in with Lab login" }).click();
  await logIn(page, "stranger");
  await expect(page.getByRole("alert")).toContainText("none of your groups there may come in here");
  await expect(page.getByLabel("Link, code or token")).toBeVisible();
  await context.close();
});
