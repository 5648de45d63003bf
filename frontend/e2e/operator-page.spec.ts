/** A robot that asks for a visible page: a window that is really minimised closes the gate of a led run. */
import { type CDPSession, expect, test } from "@playwright/test";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const carol = new StandIn("Carol");

interface Shown {
  id: string;
  state: string;
  held: { why: string } | null;
  actions: Record<string, { state: string }>;
}

function sent<T>(method: string, path: string, body: object, base = product.runnerUrl): Promise<T> {
  const headers = { "content-type": "application/json" };
  return product.ask<T>(path, { method, body: JSON.stringify(body), headers }, base);
}

/**
 * A window of the browser beside those that Playwright drives: it tells each page of its own that it has the
 * focus, so that none of these is ever hidden.
 */
class OwnWindow {
  readonly #browser: CDPSession;
  readonly #target: string;
  readonly #session: string;
  #number = 0;

  private constructor(browser: CDPSession, target: string, session: string) {
    this.#browser = browser;
    this.#target = target;
    this.#session = session;
  }

  static async open(browser: CDPSession, url: string): Promise<OwnWindow> {
    const { targetId } = await browser.send("Target.createTarget", { url, newWindow: true });
    const { sessionId } = await browser.send("Target.attachToTarget", { targetId, flatten: false });
    return new OwnWindow(browser, targetId, sessionId);
  }

  /** The value of an expression in its page. */
  async evaluate<T>(expression: string): Promise<T> {
    this.#number += 1;
    const id = this.#number;
    const answer = new Promise<T>((done, failed) => {
      const listen = ({ sessionId, message }: { sessionId: string; message: string }) => {
        const said = JSON.parse(message);
        if (sessionId !== this.#session || said.id !== id) return;
        this.#browser.off("Target.receivedMessageFromTarget", listen);
        const { exceptionDetails: fault, result } = said.result ?? { exceptionDetails: said.error };
        if (fault) failed(new Error(JSON.stringify(fault)));
        else done(result.value);
      };
      this.#browser.on("Target.receivedMessageFromTarget", listen);
    });
    const params = { expression, awaitPromise: true, returnByValue: true };
    const message = JSON.stringify({ id, method: "Runtime.evaluate", params });
    await this.#browser.send("Target.sendMessageToTarget", { sessionId: this.#session, message });
    return answer;
  }

  /** Minimises it, or shows it again, as a person does. */
  async become(windowState: "minimized" | "normal"): Promise<void> {
    const { windowId } = await this.#browser.send("Browser.getWindowForTarget", {
      targetId: this.#target,
    });
    await this.#browser.send("Browser.setWindowBounds", { windowId, bounds: { windowState } });
    const seen = windowState === "minimized" ? "hidden" : "visible";
    await expect.poll(() => this.evaluate("document.visibilityState")).toBe(seen);
  }

  async close(): Promise<void> {
    await this.#browser.send("Target.closeTarget", { targetId: this.#target });
  }
}

test.beforeAll(async () => {
  carol.start(product.data, { "*": { after_s: 2 } });
  await product.start();
  const reach = { name: carol.name, domain: DOMAIN, get_service: carol.path };
  await sent("POST", "/api/robots", { ...reach, led: true });
});

test.afterAll(async () => {
  await carol.kill();
  await product.dispose();
});

test("what is led for somebody whose window is minimised waits, and its return opens nothing", async ({
  browser,
}) => {
  const heard = async () =>
    (await product.ask<{ state: string }>("/api/robots/Carol", {}, product.runnerUrl)).state;
  await expect.poll(heard, { timeout: 30_000 }).toBe("answering");
  const rule = { operators: "all", page_presence: { wait_s: 3, stop_s: 300 } };
  await sent("PUT", "/api/robots/Carol/rights", rule);
  const graph = await product.chain(40);
  const version = await sent<{ id: string; digest: string; umrf: object }>(
    "POST",
    `/api/graphs/${graph}/versions`,
    {},
    product.url,
  );
  const member = { name: "Ada", role: "operator" };
  const { links } = await sent<{ links: { path: string }[] }>(
    "POST",
    "/api/members",
    member,
    product.url,
  );
  const invitation = links[0]?.path.replace("/#i=", "");
  const window = await OwnWindow.open(await browser.newBrowserCDPSession(), `${product.url}/`);
  const asks = (path: string, body: object) =>
    window.evaluate<string>(
      `fetch(${JSON.stringify(path)}, {method: "POST", credentials: "include",
        headers: {"content-type": "application/json"}, body: ${JSON.stringify(JSON.stringify(body))}})
        .then(async (answer) => answer.ok ? answer.text() : Promise.reject(new Error(await answer.text())))`,
    );
  await expect.poll(() => window.evaluate("document.readyState")).toBe("complete");
  await asks("/api/session", { invitation });
  await window.evaluate('location.assign("/runs")');
  const isIn = `[...document.querySelectorAll("button")].some((each) =>
    (each.getAttribute("aria-label") ?? each.textContent).startsWith("You are "))`;
  await expect.poll(() => window.evaluate(isIn).catch(String), { timeout: 30_000 }).toBe(true);

  const order = {
    ...{ version: version.id, digest: version.digest, umrf: version.umrf, graph },
    ...{ engine: "conducted", robots: { "": "Carol" }, lost: "wait", request_id: "ada" },
  };
  const run: Shown = JSON.parse(await asks(`${product.runnerUrl}/api/runs`, order));
  const now = () => product.ask<Shown>(`/api/runs/${run.id}`, {}, product.runnerUrl);
  const begun = async () =>
    Object.values((await now()).actions).filter(({ state }) => state !== "UNINITIALIZED").length;
  // While its window is visible, it goes on for longer than a page may be missing.
  await expect.poll(begun, { timeout: 60_000 }).toBeGreaterThan(4);
  expect((await now()).held).toBeNull();

  await window.become("minimized");
  await expect.poll(async () => (await now()).held?.why, { timeout: 30_000 }).toContain("page");
  const reached = await begun();
  await window.become("normal");
  await new Promise((done) => setTimeout(done, 6_000)); // three actions would have begun
  expect(await begun()).toBe(reached);
  expect((await now()).held).not.toBeNull();

  await sent("POST", `/api/runs/${run.id}/stop`, {});
  await expect.poll(async () => (await now()).state, { timeout: 30_000 }).toBe("stopped");
  await window.close();
});
