/** A comment mentions a person: in their inbox, by a notification, and by a webhook. */
import { writeFileSync } from "node:fs";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { join } from "node:path";
import { expect, test } from "@playwright/test";
import { card } from "./canvas";
import { LONG, Product } from "./product";

const product = new Product();
const got: string[] = [];
const receiver = createServer((request, response) => {
  let body = "";
  request.on("data", (part) => {
    body += part;
  });
  request.on("end", () => {
    got.push(JSON.parse(body).text);
    response.writeHead(204).end();
  });
});

test.beforeAll(async () => {
  await new Promise<void>((done) => receiver.listen(0, "127.0.0.1", done));
  const { port } = receiver.address() as AddressInfo;
  const [file, secret] = ["receivers.toml", "secret"].map((name) => join(product.data, name));
  writeFileSync(secret as string, `whsec_${Buffer.alloc(32, 7).toString("base64")}`);
  const lines = [
    "[webhooks.chat]",
    `url = "http://127.0.0.1:${port}/"`,
    `secret_file = "${secret}"`,
    'allow = ["127.0.0.1/32"]',
  ];
  writeFileSync(file as string, lines.join("\n"));
  process.env.ACTION_ASSISTANT_NOTIFICATIONS = file;
  await product.start();
  delete process.env.ACTION_ASSISTANT_NOTIFICATIONS;
});
test.afterAll(async () => {
  await product.dispose();
  receiver.close();
});

/** Notifications that the browser was asked to show, by a page that nobody looks at. */
declare global {
  interface Window {
    shown: { body: string; onclick: (() => void) | null }[];
  }
}

test("who is mentioned finds it, is notified, and comes to the comment", async ({ browser }) => {
  test.skip(LONG !== "", LONG);
  const ben = await product.person(browser, "Ben");
  const made = await ben.context.request.post(`${product.url}/api/graphs`, {
    data: { name: "ben's" },
    headers: { origin: product.url },
  });
  expect(made.status()).toBe(201);
  await ben.page.evaluate(() => {
    window.shown = [];
    class Recorded {
      static permission = "default";
      static requestPermission = async () => {
        Recorded.permission = "granted";
        return "granted";
      };
      onclick: (() => void) | null = null;
      body: string;
      constructor(_title: string, { body }: { body: string }) {
        this.body = body;
        window.shown.push(this);
      }
      close() {}
    }
    Object.defineProperty(window, "Notification", { value: Recorded });
  });
  const menu = ben.page.getByRole("button", { name: /^You are .*Ben/ });
  await menu.click();
  await ben.page.getByRole("switch", { name: "Notify me while I look elsewhere" }).check();
  await ben.page.keyboard.press("Escape");

  // His page is open and not looked at, before anything happens that he could have seen.
  await ben.page.evaluate(() => {
    Object.defineProperty(document, "hidden", { get: () => true, configurable: true });
    window.dispatchEvent(new Event("visibilitychange"));
  });
  await expect
    .poll(() =>
      ben.page.evaluate(async () => (await navigator.locks.query()).held?.map((l) => l.name)),
    )
    .not.toContain("aa.looked");

  // Ada picks him by keyboard; nothing else of the line is touched.
  const ada = await product.person(browser, "Ada");
  const graph = await product.chain(2);
  await ada.page.goto(`${product.url}/graphs/${graph}`);
  await card(ada.page, "Wait")
    .first()
    .click({ position: { x: 50, y: 30 } });
  await ada.page.keyboard.press("m");
  const field = ada.page.getByRole("textbox", { name: /^Comment on/ });
  await field.fill("Is this long enough, @Be");
  await expect(ada.page.getByRole("option", { name: "Ben" })).toBeVisible();
  await field.press("Enter");
  await expect(field).toHaveValue("Is this long enough, @Ben ");
  await field.press("Control+Enter");

  await expect(async () => {
    await ben.page.evaluate(() => window.dispatchEvent(new Event("visibilitychange")));
    expect(await ben.page.evaluate(() => window.shown.map(({ body }) => body))).toEqual([
      "Ada has mentioned you in a comment on chain_2.",
    ]);
  }).toPass({ timeout: 8_000, intervals: [500] });
  await expect(menu).toHaveAccessibleName(/1 unread mention/);
  await ben.page.setViewportSize({ width: 390, height: 844 }); // a phone
  await menu.click();
  await ben.page.getByRole("link", { name: /Ada in chain_2/ }).click();
  await expect(ben.page.getByRole("article").getByText("Is this long enough, @Ben")).toBeVisible();
  await expect(ben.page.locator("[data-thread]")).toBeFocused();
  await expect(menu).toHaveAccessibleName(/appearance$/);

  await expect.poll(() => got).toEqual(["Ada has mentioned Ben in a comment on chain_2."]);
  await ada.page.goto(`${product.url}/admin`);
  const messages = ada.page.getByRole("region", { name: "Messages", exact: true });
  await messages.getByRole("button", { name: "Send a test to chat, by the runner" }).click();
  await expect(messages.getByText("It has arrived.")).toBeVisible();
  expect(got[1]).toBe("This is a test of the receiver chat, sent by Ada.");
  expect([...ada.failures, ...ben.failures]).toEqual([]);
});
