/** A robot that asks again who starts: confirmed by a phone, then on the phone by a passkey. */

import { type Browser, type CDPSession, expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);

const product = new Product();
const david = new StandIn("David");
const PHONE = { width: 390, height: 780 };

/** Passkeys need a name: localhost. */
const url = () => product.url.replace("127.0.0.1", "localhost");
const json = (method: string, body: unknown) => ({
  method,
  body: JSON.stringify(body),
  headers: { "content-type": "application/json" },
});

interface Member {
  id: string;
  links: { path: string }[];
}

async function comeIn(browser: Browser, member: Member, viewport = { width: 1280, height: 800 }) {
  const context = await browser.newContext({ viewport });
  const page = await context.newPage();
  await page.goto(`${url()}${member.links[0]?.path}`);
  await page.getByRole("button", { name: /^Come in as/ }).click();
  await page.getByRole("button", { name: /^You are / }).waitFor();
  return page;
}

async function chooseDavid(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Choose where to start" }).click();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  await page.getByRole("button", { name: "Confirm that it is you …" }).click();
}

async function openStart(page: Page, graph: string): Promise<void> {
  await page.goto(`${url()}/graphs/${graph}`);
  await saved(page);
  await chooseDavid(page);
}

/** A device that keeps passkeys, unlocked by its person. */
async function authenticator(page: Page): Promise<[CDPSession, string]> {
  const session = await page.context().newCDPSession(page);
  await session.send("WebAuthn.enable");
  const options = { protocol: "ctap2", transport: "internal", hasResidentKey: true } as const;
  const { authenticatorId } = await session.send("WebAuthn.addVirtualAuthenticator", {
    options: {
      ...options,
      hasUserVerification: true,
      isUserVerified: true,
      automaticPresenceSimulation: true,
    },
  });
  return [session, authenticatorId];
}

test.beforeAll(async () => {
  david.start(product.data, { "*": { after_s: 1 } });
  await product.start();
  const robot = { name: david.name, domain: DOMAIN, get_service: david.path };
  await product.ask("/api/robots", json("POST", robot), product.runnerUrl);
  await product.ask("/api/robots/David/rights", json("PUT", { ask_again: 30 }), product.runnerUrl);
});

test.afterAll(async () => {
  await david.kill();
  await product.dispose();
});

test("a robot that asks again is started after a phone, or a passkey, has confirmed", async ({
  browser,
}) => {
  const graph = await product.chain(1);
  const mari = await product.ask<Member>(
    "/api/members",
    json("POST", { name: "Mari", role: "operator" }),
  );
  const tablet = await comeIn(browser, mari);
  const again = await product.ask<Member>(`/api/members/${mari.id}/link`, json("POST", {}));
  const phone = await comeIn(browser, again, PHONE);

  await openStart(tablet, graph);
  const question = phone.getByRole("alertdialog", { name: "Is it you?" });
  const asking = tablet.getByRole("dialog", { name: "Confirm that it is you" });

  // Escape closes what is in front, and nothing behind it; opened again, it is in front again.
  await asking.getByRole("button", { name: "Close" }).press("Escape");
  await expect(asking).toBeHidden();
  await expect(tablet.getByRole("button", { name: "Confirm that it is you …" })).toBeFocused();
  await expect(tablet.getByRole("checkbox", { name: /^David/ })).toBeChecked();
  await tablet.keyboard.press("Escape");
  await expect(tablet.getByRole("dialog")).toHaveCount(0);
  await chooseDavid(tablet);
  await asking.getByRole("button", { name: "On another device" }).click();
  const number = await asking.locator("b").textContent();
  await expect(question).toContainText(`wants to start on David. Does it show ${number}?`);
  await question.getByRole("button", { name: "No" }).click();
  await expect(asking).toContainText("Your other device has said that it was not you.");
  await expect(question).toBeHidden();
  await asking.getByRole("button", { name: "On another device" }).click();
  await question.getByRole("button", { name: "Yes, it is me" }).click();
  await expect(asking).toBeHidden();
  await expect(tablet.getByRole("button", { name: /^Start v1 on David/ })).toBeEnabled();

  // Registered while it is certain who does it, the passkey counts at once, also where it is synced to.
  const [keys, id] = await authenticator(tablet);
  await tablet.goto(`${url()}/people`);
  await tablet.getByRole("textbox", { name: "Name" }).fill("Mari’s key");
  await tablet.getByRole("button", { name: "Register a passkey" }).click();
  await expect(tablet.getByRole("listitem").filter({ hasText: "Mari’s key" })).toBeVisible();
  const [phoneKeys, phoneId] = await authenticator(phone);
  const { credentials } = await keys.send("WebAuthn.getCredentials", { authenticatorId: id });
  for (const credential of credentials) {
    await phoneKeys.send("WebAuthn.addCredential", { authenticatorId: phoneId, credential });
  }
  await openStart(phone, graph);
  await phone.getByRole("button", { name: "With a passkey" }).click();
  const start = phone.getByRole("button", { name: /^Start v1 on David/ });
  await expect(start).toBeEnabled();
  await expect(phone.getByRole("dialog", { name: "Confirm that it is you" })).toBeHidden();
  await start.focus();
  await phone.keyboard.down("Enter");
  await expect(phone.getByRole("dialog", { name: /^Start v1/ })).toBeHidden();
  await phone.keyboard.up("Enter");
  const state = async () =>
    (await product.ask<{ state: string }[]>("/api/runs", {}, product.runnerUrl))[0]?.state;
  await expect.poll(state, { timeout: 20_000 }).toBe("finished");
});
