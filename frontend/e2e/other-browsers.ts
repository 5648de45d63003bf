/** Firefox over WebDriver BiDi and WebKit over WebDriver, driven alike: Debian brings both. */

import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import WebSocket from "ws";
import { freePort, pause } from "./product";

export type Engine = "Firefox" | "WebKit";
const MACHINE = process.arch === "arm64" ? "aarch64" : "x86_64";
const MINI_BROWSER = `/usr/lib/${MACHINE}-linux-gnu/webkit2gtk-4.1/MiniBrowser`;
const PROGRAMS = {
  Firefox: ["/usr/bin/firefox-esr"],
  WebKit: ["/usr/bin/WebKitWebDriver", MINI_BROWSER, "/usr/bin/Xvfb"],
} as const;

/** Why a browser cannot be tried here; "" when it can. */
export function missingBrowser(engine: Engine): string {
  const lacking = PROGRAMS[engine].filter((program) => !existsSync(program));
  return lacking.length === 0 ? "" : `${lacking.join(", ")} is not installed: make browsers`;
}

/** Actions of an input source, as WebDriver spells them. */
type Steps = readonly Record<string, unknown>[];
type Send = (method: string, params: Record<string, unknown>) => Promise<unknown>;

/** What both protocols do in their own way. */
interface Protocol {
  go(url: string): Promise<void>;
  /** The value of an expression of JavaScript in the page. */
  value(expression: string): Promise<unknown>;
  perform(sources: readonly Record<string, unknown>[]): Promise<void>;
  /** A picture of what is seen, PNG in base64. */
  picture(): Promise<string>;
  end(): Promise<void>;
}

interface Spot {
  x: number;
  y: number;
}

/** How things are found by what assistive technology calls them; runs in the page. */
const FIND = `(role, name) => [...document.querySelectorAll(
  { button: "button, [role=button]", link: "a[href]", tab: "[role=tab], label",
    textbox: "input, textarea, [role=combobox]", group: "[role=group]" }[role])]
  .find((each) => each.getClientRects().length > 0 && new RegExp(name).test(
    each.getAttribute("aria-label") ?? each.labels?.[0]?.textContent ?? each.textContent.trim()))`;

/** Somebody at a browser that Playwright does not bring. */
export class OtherBrowser {
  private readonly protocol: Protocol;
  /** What touches the screen. */
  private readonly pointer: "mouse" | "touch";

  constructor(protocol: Protocol, pointer: "mouse" | "touch") {
    this.protocol = protocol;
    this.pointer = pointer;
  }

  static async open(engine: Engine, pointer: "mouse" | "touch"): Promise<OtherBrowser> {
    const [width, height] = pointer === "touch" ? [390, 844] : [1280, 860];
    const begin = engine === "Firefox" ? firefox : webkit;
    return new OtherBrowser(await begin(width, height), pointer);
  }

  go(url: string): Promise<void> {
    return this.protocol.go(url);
  }

  /** Waits until an expression of JavaScript is true in the page. */
  async until(expression: string, seconds = 20): Promise<void> {
    const deadline = Date.now() + seconds * 1000;
    while ((await this.protocol.value(`Boolean(${expression})`)) !== true) {
      if (Date.now() > deadline) throw new Error(`never came to be: ${expression}`);
      await pause(100);
    }
  }

  /** Waits for words on the page. */
  sees(words: string): Promise<void> {
    return this.until(`document.body.innerText.includes(${JSON.stringify(words)})`);
  }

  /** Presses what is called so, and holds it, ms. */
  async press(role: string, name: string, held = 40): Promise<void> {
    const found = `(${FIND})(${JSON.stringify(role)}, ${JSON.stringify(name)})`;
    await this.until(`${found} && !${found}.disabled`);
    await this.protocol.value(`${found}.scrollIntoView({ block: "nearest" })`);
    const expression = `(() => { const { x, y, width, height } = ${found}.getBoundingClientRect();
      return JSON.stringify({ x: x + width / 2, y: y + height / 2 }) })()`;
    const { x, y } = JSON.parse(String(await this.protocol.value(expression))) as Spot;
    const point = { x: Math.round(x), y: Math.round(y) };
    await this.protocol.perform([
      {
        type: "pointer",
        id: "pointer",
        parameters: { pointerType: this.pointer },
        actions: [
          { type: "pointerMove", ...point, duration: 0 },
          { type: "pointerDown", button: 0 },
          { type: "pause", duration: held },
          { type: "pointerUp", button: 0 },
        ],
      },
    ]);
  }

  /** Presses keys one after the other: letters, or the names of others such as Enter. */
  async type(...texts: string[]): Promise<void> {
    const keys = texts.flatMap((text) => (text in KEYS ? [KEYS[text] ?? ""] : [...text]));
    const actions: Steps = keys.flatMap((value) => [
      { type: "keyDown", value },
      { type: "keyUp", value },
    ]);
    await this.protocol.perform([{ type: "key", id: "keys", actions }]);
  }

  async picture(path: string): Promise<void> {
    writeFileSync(path, Buffer.from(await this.protocol.picture(), "base64"));
  }

  end(): Promise<void> {
    return this.protocol.end();
  }
}

const KEYS: Readonly<Record<string, string>> = { Enter: "\uE007", Escape: "\uE00C" };

async function firefox(width: number, height: number): Promise<Protocol> {
  const profile = mkdtempSync(join(tmpdir(), "action-assistant-firefox-"));
  writeFileSync(join(profile, "user.js"), 'user_pref("dom.w3c_touch_events.enabled", 1);\n');
  const port = await freePort();
  const flags = ["--headless", "--no-remote", "--profile", profile];
  const child = spawn(PROGRAMS.Firefox[0], [...flags, `--remote-debugging-port=${port}`], {
    stdio: "ignore",
  });
  const socket = await connected(`ws://127.0.0.1:${port}/session`);
  const send = bidi(socket);
  await send("session.new", { capabilities: {} });
  const tree = (await send("browsingContext.getTree", {})) as { contexts: { context: string }[] };
  const context = tree.contexts[0]?.context;
  await send("browsingContext.setViewport", { context, viewport: { width, height } });
  return {
    go: async (url) =>
      void (await send("browsingContext.navigate", { context, url, wait: "complete" })),
    value: async (expression) => {
      const given = { expression, target: { context }, awaitPromise: true };
      const answer = (await send("script.evaluate", given)) as { result?: { value?: unknown } };
      return answer.result?.value;
    },
    perform: async (actions) => void (await send("input.performActions", { context, actions })),
    picture: async () =>
      ((await send("browsingContext.captureScreenshot", { context })) as { data: string }).data,
    end: async () => {
      socket.close();
      await ended(child);
      rmSync(profile, { recursive: true, force: true, maxRetries: 5 });
    },
  };
}

/** A browser needs a moment before it listens. */
async function connected(url: string): Promise<WebSocket> {
  for (let tries = 0; ; tries += 1) {
    const socket = new WebSocket(url);
    const open = await new Promise<boolean>((done) => {
      socket.once("open", () => done(true));
      socket.once("error", () => done(false));
    });
    if (open) return socket;
    if (tries > 200) throw new Error(`nothing answers at ${url}`);
    await pause(100);
  }
}

function bidi(socket: WebSocket): Send {
  let last = 0;
  const waiting = new Map<number, (answer: { result?: unknown; message?: string }) => void>();
  socket.on("message", (data) => {
    const answer = JSON.parse(String(data)) as { id?: number; result?: unknown; message?: string };
    waiting.get(answer.id ?? -1)?.(answer);
  });
  return async (method, params) => {
    last += 1;
    const id = last;
    const answer = await new Promise<{ result?: unknown; message?: string }>((done) => {
      waiting.set(id, done);
      socket.send(JSON.stringify({ id, method, params }));
    });
    waiting.delete(id);
    if (answer.result === undefined) throw new Error(`${method}: ${answer.message}`);
    return answer.result;
  };
}

async function webkit(width: number, height: number): Promise<Protocol> {
  const [port, display] = [await freePort(), `:${90 + Math.floor(Math.random() * 400)}`];
  const screen = spawn("/usr/bin/Xvfb", [display, "-screen", "0", "1300x1000x24"], {
    stdio: "ignore",
  });
  const driver = spawn(PROGRAMS.WebKit[0], ["-p", String(port)], {
    stdio: "ignore",
    env: {
      ...process.env,
      DISPLAY: display,
      // There is no graphics card here, and root has no sandbox.
      LIBGL_ALWAYS_SOFTWARE: "1",
      WEBKIT_DISABLE_DMABUF_RENDERER: "1",
      WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS: "1",
    },
  });
  const call = async (method: string, path: string, body?: object): Promise<unknown> => {
    const answer = await fetch(`http://127.0.0.1:${port}${path}`, {
      method,
      ...(body ? { body: JSON.stringify(body) } : {}),
    });
    const { value } = (await answer.json()) as { value: unknown };
    if (!answer.ok) throw new Error(`${path}: ${JSON.stringify(value).slice(0, 300)}`);
    return value;
  };
  const options = { "webkitgtk:browserOptions": { binary: MINI_BROWSER, args: ["--automation"] } };
  const wanted = { capabilities: { alwaysMatch: options } };
  const { sessionId } = (await patiently(() => call("POST", "/session", wanted))) as {
    sessionId: string;
  };
  const at = `/session/${sessionId}`;
  await call("POST", `${at}/window/rect`, { x: 0, y: 0, width, height });
  return {
    go: async (url) => void (await call("POST", `${at}/url`, { url })),
    value: (expression) =>
      call("POST", `${at}/execute/sync`, { script: `return ${expression}`, args: [] }),
    perform: async (actions) => void (await call("POST", `${at}/actions`, { actions })),
    picture: async () => String(await call("GET", `${at}/screenshot`)),
    end: async () => {
      await call("DELETE", at).catch(() => {});
      await Promise.all([ended(driver), ended(screen)]);
    },
  };
}

async function patiently<T>(ask: () => Promise<T>): Promise<T> {
  for (let tries = 0; ; tries += 1) {
    try {
      return await ask();
    } catch (error) {
      if (tries > 50) throw error;
      await pause(200);
    }
  }
}

function ended(child: ChildProcess): Promise<void> {
  if (child.exitCode !== null || child.signalCode !== null) return Promise.resolve();
  return new Promise((done) => {
    child.once("exit", () => done());
    child.kill("SIGKILL");
  });
}
