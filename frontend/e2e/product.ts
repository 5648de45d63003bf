/** The real product for browser tests: `action-assistant serve` on free ports, killable at any moment. */

import { type ChildProcess, execFile, spawn } from "node:child_process";
import { randomInt } from "node:crypto";
import { mkdtempSync, openSync, readFileSync, rmSync } from "node:fs";
import { createServer } from "node:net";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { promisify } from "node:util";
import type { Browser, BrowserContext, Page } from "@playwright/test";

const COMMAND = resolve(import.meta.dirname, "../../.venv/bin/action-assistant");
export const TOKEN = "browser-test-token-0123456789abcdef0123456789";

/** Why a test is skipped that only `make soak` has time for; empty in `make soak`. */
export const LONG = process.env.TEST_LONG ? "" : "takes long: `make soak ARGS=browser`";

/** A running editor and runner with a data folder of their own. */
export class Product {
  readonly data = mkdtempSync(join(tmpdir(), "action-assistant-"));
  readonly log = join(this.data, "serve.log");
  port = 0;
  private readonly flags: readonly string[];
  private readonly hosts: string;
  private readonly settings: Readonly<Record<string, string>>;
  private process: ChildProcess | undefined;
  private more: (port: number) => readonly string[] = () => [];
  private readonly contexts: BrowserContext[] = [];

  /** `hosts` are names that lead here, for others on the network; `settings`: more of its environment. */
  constructor(
    flags: readonly string[] = [],
    hosts = "",
    settings: Readonly<Record<string, string>> = {},
  ) {
    this.flags = flags;
    this.hosts = hosts;
    this.settings = settings;
  }

  get scheme(): string {
    return this.flags.includes("--tls") ? "https" : "http";
  }

  get url(): string {
    return `${this.scheme}://127.0.0.1:${this.port}`;
  }

  get runnerUrl(): string {
    return `${this.scheme}://127.0.0.1:${this.port + 1}`;
  }

  /** Starts both processes and waits until they answer. `more`: flags that name the port of the editor. */
  async start(more: (port: number) => readonly string[] = () => []): Promise<void> {
    this.more = more;
    const known = this.port !== 0;
    for (let tries = 0; ; tries += 1) {
      if (!known) this.port = await freePorts();
      this.spawn();
      try {
        await this.untilReady();
        return;
      } catch (error) {
        // Between being found free and being bound, a port may be taken by anybody.
        if (known || tries > 2 || !String(error).includes("is taken")) throw error;
        await this.kill();
      }
    }
  }

  private spawn(): void {
    const log = openSync(this.log, "a");
    this.process = spawn(
      COMMAND,
      [
        "serve",
        "--data",
        this.data,
        "--port",
        String(this.port),
        "--no-open",
        ...this.flags,
        ...this.more(this.port),
      ],
      {
        detached: true,
        stdio: ["ignore", log, log],
        env: {
          ...process.env,
          ...this.settings,
          ACTION_ASSISTANT_TOKEN: TOKEN,
          ACTION_ASSISTANT_HOSTS: this.hosts,
        },
      },
    );
  }

  /** Waits until both processes can do their work. */
  async untilReady(): Promise<void> {
    const deadline = Date.now() + 60_000;
    for (const url of [this.url, this.runnerUrl]) {
      while (!(await answers(`${url}/readyz`))) {
        const over = this.process === undefined || this.process.exitCode !== null;
        if (over || Date.now() > deadline) throw new Error(readFileSync(this.log, "utf8"));
        await pause(50);
      }
    }
  }

  /** Runs a command of the product on its data folder; what it prints. */
  async command(...words: string[]): Promise<string> {
    const all = [...words, "--data", this.data];
    return (await promisify(execFile)(COMMAND, all)).stdout;
  }

  /** kill -9 of everything at once. */
  async kill(): Promise<void> {
    const { process: child } = this;
    if (child?.pid === undefined) return;
    this.process = undefined;
    if (child.exitCode !== null || child.signalCode !== null) return;
    const gone = new Promise((done) => child.once("exit", done));
    process.kill(-child.pid, "SIGKILL");
    await gone;
    // Its children are nobody's now, and hold their ports until the system has seen to them.
    const deadline = Date.now() + 10_000;
    while (!(await areFree(this.port)) && Date.now() < deadline) await pause(20);
  }

  /** The process id of the editor or the runner. */
  pid(which: "editor" | "runner"): number {
    const parent = this.process?.pid;
    const children = readFileSync(`/proc/${parent}/task/${parent}/children`, "utf8");
    for (const child of children.trim().split(" ")) {
      const words = readFileSync(`/proc/${child}/cmdline`, "utf8").split("\0");
      if (words.includes(which)) return Number(child);
    }
    throw new Error(`no ${which}`);
  }

  /** Kills it and throws its data away; whoever was at a browser has left. Pages that nobody closes would go on
   * asking for it, beside all tests that come after them. */
  async dispose(): Promise<void> {
    await Promise.all(this.contexts.map((context) => context.close()));
    await this.kill();
    rmSync(this.data, { recursive: true, force: true, maxRetries: 5 });
  }

  /** A request as a program makes it. */
  async ask<T>(path: string, init: RequestInit = {}, base = this.url): Promise<T> {
    const headers = { authorization: `Bearer ${TOKEN}`, ...(init.headers ?? {}) };
    const answer = await fetch(base + path, { ...init, headers });
    if (!answer.ok) throw new Error(`${path}: ${answer.status} ${await answer.text()}`);
    return (answer.status === 204 ? undefined : await answer.json()) as T;
  }

  /** Make a graph `chain_LENGTH` of `actions` that follow one another, and return its id. The simulator gives
   * each a second. A Stop on a robot is proven for certain only where no next action can be loading. */
  async chain(length: number, actions = length): Promise<string> {
    const named = (instance: number) => ({ name: "Wait", instance_id: instance });
    const graph = {
      graph_name: `chain_${length}`,
      graph_entry: [named(0)],
      graph_exit: [named(actions - 1)],
      actions: Array.from({ length: actions }, (_, i) => ({
        ...named(i),
        type: "sync",
        parents: i === 0 ? [] : [named(i - 1)],
        children: i === actions - 1 ? [] : [named(i + 1)],
      })),
    };
    const { id } = await this.ask<{ id: string }>("/api/graphs", {
      method: "POST",
      body: JSON.stringify(graph),
      headers: { "content-type": "application/json" },
    });
    return id;
  }

  /** A person with a browser of their own, signed in, on the first page. */
  async person(
    browser: Browser,
    name: string,
    { loadsAhead = LONG === "", panels = "open", ...options }: PersonOptions = {},
  ): Promise<Person> {
    const context = await browser.newContext(options);
    this.contexts.push(context);
    if (panels === "open") await context.addInitScript(keepPanelsOpen);
    if (!loadsAhead) await context.addInitScript(saveData);
    const page = await context.newPage();
    const failures: string[] = [];
    page.on("pageerror", (error) => failures.push(error.message));
    await page.goto(`${this.url}/#t=${TOKEN}`);
    const field = page.getByRole("textbox", { name: /others see you/i });
    await field.fill(name);
    await field.press("Enter");
    await field.waitFor({ state: "detached" });
    return { context, page, failures };
  }
}

/** `loadsAhead`: whether the page loads what it does not show yet while it has nothing to do, as it does but
 * where data is to be saved. That costs more than the first page, so in CI only those do who need it. */
export type PersonOptions = Parameters<Browser["newContext"]>[0] & {
  loadsAhead?: boolean;
  /**
   * `open`: the person has the lists and the course of the run beside the canvas, and on a phone the canvas; else
   * they are as at first.
   */
  panels?: "open" | "folded";
};

/** A person who has once folded a panel keeps it folded. */
function keepPanelsOpen(): void {
  for (const panel of ["aa.list-folded", "aa.strip-folded"])
    if (localStorage.getItem(panel) === null) localStorage.setItem(panel, "false");
  if (localStorage.getItem("aa.phone-pane") === null)
    localStorage.setItem("aa.phone-pane", JSON.stringify("canvas"));
}

function saveData(): void {
  Object.defineProperty(navigator, "connection", { value: { saveData: true } });
}

/** Somebody at a browser. `failures` are errors that the page threw. */
export interface Person {
  context: BrowserContext;
  page: Page;
  failures: string[];
}

export function pause(milliseconds: number): Promise<void> {
  return new Promise((done) => setTimeout(done, milliseconds));
}

export async function answers(url: string): Promise<boolean> {
  try {
    return (await fetch(url)).ok;
  } catch {
    return false;
  }
}

/**
 * The first of two neighbouring ports that nobody listens on. Of those that the system hands out to
 * whoever connects, any may be taken again while the product is away.
 */
async function freePorts(): Promise<number> {
  for (;;) {
    const port = 10_000 + 2 * randomInt(11_000);
    if (await areFree(port)) return port;
  }
}

/** Whether nobody listens on a port and the one after it. */
async function areFree(port: number): Promise<boolean> {
  const held = await Promise.allSettled([listen(port), listen(port + 1)]);
  for (const each of held) if (each.status === "fulfilled") await each.value.close();
  return held.every(({ status }) => status === "fulfilled");
}

/** A port that nobody listens on. */
export async function freePort(): Promise<number> {
  const found = await listen(0);
  await found.close();
  return found.port;
}

function listen(port: number): Promise<{ port: number; close: () => Promise<void> }> {
  return new Promise((done, fail) => {
    const server = createServer();
    server.once("error", fail);
    server.listen(port, "127.0.0.1", () => {
      const address = server.address();
      if (address === null || typeof address === "string") throw new Error("no port");
      done({
        port: address.port,
        close: () => new Promise((closed) => server.close(() => closed())),
      });
    });
  });
}
