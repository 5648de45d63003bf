/**
 * The main job through a proxy with TLS, under a real name and below a path: draw, run, Stop; and what
 * the page says where the proxy is not as the documentation has it.
 */

import { type Browser, expect, type Page, test } from "@playwright/test";
import { CHROMIUM, LAN_ARGS } from "../playwright.config";
import { add, atRest, card, saved, start, umrfOf } from "./canvas";
import { freePort, LONG, type Person, Product, TOKEN } from "./product";
import { type Kind, missing, NAME, ProxyServer } from "./proxies";

/** A picture for who looks, when a folder for them is named. */
async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env.PROXY_PICTURES;
  if (folder !== undefined) await page.screenshot({ path: `${folder}/${name}.png` });
}

/** The same, also as on a phone. */
async function pictures(page: Page, name: string): Promise<void> {
  if (process.env.PROXY_PICTURES === undefined) return;
  await picture(page, name);
  await page.setViewportSize({ width: 390, height: 844 });
  await atRest(page);
  await picture(page, `${name}-phone`);
  await page.setViewportSize({ width: 1440, height: 900 });
}

interface Setting {
  readonly product: Product;
  readonly proxy: ProxyServer;
  end(): Promise<void>;
}

async function behind(kind: Kind, path: string, named = true): Promise<Setting> {
  const proxy = new ProxyServer(kind, path, await freePort());
  const product = new Product(named ? ["--public-url", `${proxy.url}/`] : [], named ? "" : NAME);
  await product.start();
  await proxy.start(product.port);
  return {
    product,
    proxy,
    end: async () => {
      await proxy.dispose();
      await product.dispose();
    },
  };
}

/** Somebody opens the link that the server printed, at the public address. */
async function arrive(
  browser: Browser,
  proxy: ProxyServer,
  link = `/#t=${TOKEN}`,
  options: Parameters<Browser["newContext"]>[0] = {},
  prepare: (page: Page) => Promise<void> = async () => {},
): Promise<Person & { refused: string[] }> {
  const context = await browser.newContext({ ignoreHTTPSErrors: true, ...options });
  const page = await context.newPage();
  await prepare(page);
  const failures: string[] = [];
  const refused: string[] = [];
  page.on("pageerror", (error) => failures.push(error.message));
  page.on("response", (answer) => {
    if (answer.status() >= 400) refused.push(`${answer.status()} ${answer.url()}`);
  });
  await page.goto(proxy.url + link);
  const field = page.getByRole("textbox", { name: /others see you/i });
  await field.fill("Ada");
  await field.press("Enter");
  await field.waitFor({ state: "detached" });
  return { context, page, failures, refused };
}

const stopButton = (page: Page) => page.getByRole("button", { name: /^Stop run/ });

function stateOf(product: Product, graph: string): () => Promise<string | undefined> {
  return async () => {
    const runs = await product.ask<{ state: string }[]>(
      `/api/runs?graph=${graph}`,
      {},
      product.runnerUrl,
    );
    return runs[0]?.state;
  };
}

const CASES = [
  ["nginx", "/temoto"],
  ["caddy", "/temoto"],
  ["nginx", ""],
  ["caddy", ""],
] as const;

/** Say why a case is skipped: only `make soak` has time for more than the first one. */
const whyNot = (kind: Kind, path: string) =>
  LONG !== "" && (kind !== "nginx" || path === "") ? LONG : missing(kind);

for (const [kind, path] of CASES) {
  test.describe(`${kind}, ${path === "" ? "at the root" : "below a path"}`, () => {
    test.skip(whyNot(kind, path) !== "", whyNot(kind, path));
    let setting: Setting;
    test.beforeAll(async () => {
      setting = await behind(kind, path);
    });
    test.afterAll(() => setting?.end());

    test("somebody draws, opens a deep link anew, runs and stops", async ({ browser }) => {
      test.setTimeout(120_000);
      const { product, proxy } = setting;
      const { page, context, failures, refused } = await arrive(browser, proxy);
      expect(await page.evaluate(() => window.isSecureContext)).toBe(true);
      const cookies = await context.cookies();
      const names = cookies.map(({ name }) => name).sort();
      expect(names).toEqual([`aa_${product.port}`, `aa_${product.port}_device`]);
      for (const cookie of cookies) {
        expect(cookie).toMatchObject({
          domain: NAME,
          path: `${path}/`,
          secure: true,
          httpOnly: true,
          sameSite: "Strict",
        });
      }

      const graph = await product.chain(60);
      await page.goto(`${proxy.url}/graphs/${graph}`);
      await expect(card(page, "Wait")).toBeVisible({ timeout: 45_000 });
      await saved(page);
      await add(page, "Sooner");
      await saved(page);
      await page.reload();
      await expect(card(page, "Sooner")).toBeVisible({ timeout: 45_000 });
      await saved(page);

      await start(page);
      await expect(stopButton(page)).toBeVisible();
      await picture(page, `${kind}${path.replace("/", "-")}`);
      await stopButton(page).click();
      await expect.poll(stateOf(product, graph)).toBe("stopped");
      await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
      await pictures(page, `${kind}${path.replace("/", "-")}-stopped`);

      // Every way in the page stays below the path, and what it links to does.
      await page.getByRole("link", { name: "Runs", exact: true }).click();
      await expect(page).toHaveURL(`${proxy.url}/runs`);
      await page.getByRole("link", { name: "Robots", exact: true }).click();
      await expect(page).toHaveURL(`${proxy.url}/robots`);
      // The bar comes anew with the page, without what was opened in the bar before.
      await expect(page.getByRole("heading", { name: "No robot yet" })).toBeVisible();
      await page.getByRole("button", { name: "Share", exact: true }).click();
      const dialog = page.getByRole("dialog", { name: "Share" });
      await expect(
        dialog.getByText("The proxy in front of this server has the certificate"),
      ).toBeVisible();
      await dialog.getByRole("textbox", { name: "For whom" }).fill("Mari");
      await dialog.getByRole("button", { name: "New link" }).click();
      const link = await dialog.getByRole("textbox", { name: "Link for Mari" }).inputValue();
      expect(link).toContain(`${proxy.url}/#i=`);
      await dialog.getByRole("button", { name: "Code of the link for Mari" }).click();
      const code = dialog.getByRole("img", { name: "QR code of the link for Mari" });
      await expect
        .poll(() => code.evaluate((img: HTMLImageElement) => img.naturalWidth))
        .not.toBe(0);
      await pictures(page, `${kind}${path.replace("/", "-")}-share`);
      expect(failures).toEqual([]);
      expect(refused.filter((each) => !each.startsWith("401"))).toEqual([]);
      expect(refused.length).toBeLessThan(3);
      await context.close();
    });

    test("Help is searched there, by whoever comes, and leads back", async ({ browser }) => {
      const { proxy } = setting;
      const context = await browser.newContext({ ignoreHTTPSErrors: true });
      const page = await context.newPage();
      await page.goto(`${proxy.url}/help`);
      await expect(page).toHaveURL(`${proxy.url}/help/`);
      await page.getByRole("textbox", { name: "Search" }).first().fill("unconfirmed");
      await page.keyboard.press("Enter");
      await page.getByRole("link", { name: /> STOP UNCONFIRMED$/ }).click();
      await expect(page.getByText("Assume that the robot moves.")).toBeVisible();
      await page.getByRole("link", { name: "Open Action Assistant" }).click();
      await expect(page).toHaveURL(`${proxy.url}/`);
      await context.close();
    });

    test("Stop does not pass the editor's process: frozen, with requests that wait, or dead", async ({
      browser,
    }) => {
      test.setTimeout(120_000);
      const { product, proxy } = setting;
      const { page, context, failures } = await arrive(browser, proxy);
      for (const how of ["frozen", "dead"] as const) {
        const graph = await product.chain(50 + how.length);
        await page.goto(`${proxy.url}/graphs/${graph}`);
        await saved(page);
        await start(page);
        await expect(stopButton(page)).toBeVisible();
        const editor = product.pid("editor");
        process.kill(editor, "SIGSTOP");
        try {
          // Ten requests that are not answered would hold up every other one to a second port.
          await page.evaluate((url) => {
            for (let i = 0; i < 10; i += 1) void fetch(`${url}/api/graphs?n=${i}`).catch(() => {});
          }, proxy.url);
          if (how === "dead") process.kill(editor, "SIGKILL");
          await stopButton(page).click();
          await expect.poll(stateOf(product, graph)).toBe("stopped");
          await expect(page.getByText(/Run \d+: stopped/)).toBeVisible();
        } finally {
          if (how === "frozen") process.kill(editor, "SIGCONT");
        }
        await product.untilReady();
      }
      expect(failures).toEqual([]);
      await context.close();
    });
  });
}

test.describe("where the proxy is not as it should be", () => {
  test.skip((LONG || missing("nginx")) !== "", LONG || missing("nginx"));
  let setting: Setting;
  test.beforeAll(async () => {
    setting = await behind("nginx", "/temoto");
    await setting.proxy.end();
  });
  test.afterAll(() => setting?.end());

  const alert = (page: Page) =>
    page.getByRole("alert").filter({ hasText: /STOP (MAY REACH NOBODY|CANNOT BE PROVEN HERE)/ });

  /** The same address, shown by a proxy with another file, as long as `look` takes. */
  async function through(
    change: (text: string) => string,
    look: (proxy: ProxyServer, product: Product) => Promise<void>,
  ): Promise<void> {
    await setting.proxy.start(setting.product.port, change);
    try {
      await look(setting.proxy, setting.product);
    } finally {
      await setting.proxy.end();
    }
  }

  test("the page opens below a path without a server, at a deep link too", async ({ browser }) => {
    test.setTimeout(120_000);
    const { product, proxy } = setting;
    await proxy.start(product.port);
    // A browser runs no service worker of a certificate that it does not trust, whatever a test says.
    const trusting = await browser.browserType().launch({
      executablePath: CHROMIUM,
      args: [...LAN_ARGS, "--ignore-certificate-errors"],
    });
    const { page, context, failures } = await arrive(trusting, proxy, undefined, {
      serviceWorkers: "allow",
    });
    const graph = await product.chain(3);
    await page.goto(`${proxy.url}/graphs/${graph}`);
    await saved(page);
    await add(page, "Kept");
    await saved(page);
    await page.evaluate(() => navigator.serviceWorker.ready);
    await expect.poll(() => page.evaluate(() => caches.keys())).toHaveLength(1);
    await page.close();
    await proxy.end();

    const later = await context.newPage();
    await later.goto(`${proxy.url}/graphs/${graph}`);
    await expect(card(later, "Kept")).toBeVisible();
    await add(later, "Alone");
    await expect(later.getByText(/(offline|server away).*1 change/i).first()).toBeVisible();
    await expect(later.getByRole("button", { name: /^Run v1: not connected/ })).toBeDisabled();
    await picture(later, "nginx-offline");
    await proxy.start(product.port);
    await saved(later);
    const { actions } = await umrfOf(product, graph);
    expect(actions.map(({ name }) => name).sort()).toEqual([
      ...["Alone", "Kept", "Wait", "Wait", "Wait"],
    ]);
    expect(failures).toEqual([]);
    await trusting.close();
    await proxy.end();
  });

  test("one that passes no sockets on is named, for STOP and for edits", async ({ browser }) => {
    const change = (text: string) => text.replace(/proxy_set_header (Upgrade|Connection) .*/g, "");
    await through(change, async (proxy, product) => {
      const { page, context } = await arrive(browser, proxy);
      await expect(alert(page)).toContainText("pass WebSockets on");
      await expect(page.getByText("state unknown")).toBeVisible();
      await page.goto(`${proxy.url}/graphs/${await product.chain(3)}`);
      await page.getByText("No connection", { exact: true }).hover();
      await expect(page.getByText(/may not pass WebSockets on/).first()).toBeVisible();
      await pictures(page, "no-sockets");
      await context.close();
    });
  });

  test("one that leads the runner's part to the editor is named", async ({ browser }) => {
    const change = (text: string) => text.replace("location /temoto/runner/", "location /nowhere/");
    await through(change, async (proxy) => {
      const { page, context } = await arrive(browser, proxy);
      await expect(alert(page)).toContainText(
        "the proxy has to forward this address to the runner",
      );
      await context.close();
    });
  });

  test("one that replaces the host is named at the door", async ({ browser }) => {
    const change = (text: string) => text.replace(/proxy_set_header Host .*/, "");
    await through(change, async (proxy) => {
      const context = await browser.newContext({ ignoreHTTPSErrors: true });
      const page = await context.newPage();
      await page.goto(`${proxy.url}/#t=${TOKEN}`);
      await expect(page.getByText(/has to pass on the Host header/)).toBeVisible();
      await pictures(page, "no-host");
      await context.close();
    });
  });

  test("without a public address the page is not blank, and says what is missing", async ({
    browser,
  }) => {
    const unnamed = await behind("nginx", "", false);
    try {
      const { page, context, failures, refused } = await arrive(
        browser,
        unnamed.proxy,
        undefined,
        {},
        ({ clock }) => clock.install(),
      );
      await expect(alert(page)).toContainText(`--public-url ${unnamed.proxy.url}/`);
      await pictures(page, "no-public-url");
      const before = refused.length;
      for (let second = 0; second < 5; second += 1) {
        await page.clock.runFor(1_000);
        // What was asked for in this second is answered before the next one.
        await page.evaluate(() => fetch(location.href).then((answer) => answer.text()));
      }
      expect(refused.length - before).toBeLessThan(2);
      expect(failures).toEqual([]);
      await context.close();
    } finally {
      await unnamed.end();
    }
  });
});
