/** The runner of a second hall, beside a product whose page leads both. */

import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, mkdtempSync, openSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { answers, freePort, type Product, pause, TOKEN } from "./product";

const ROOT = resolve(import.meta.dirname, "../..");
const SPEAKING = process.env.ACTION_ASSISTANT_RUNNER_PYTHON ?? join(ROOT, ".venv-ros/bin/python");
const PYTHON = existsSync(SPEAKING) ? SPEAKING : join(ROOT, ".venv/bin/python");

export class SecondRunner {
  readonly data = mkdtempSync(join(tmpdir(), "action-assistant-hall-b-"));
  port = 0;
  #process: ChildProcess | undefined;

  get url(): string {
    return `http://127.0.0.1:${this.port}`;
  }

  async start(pagePort: number): Promise<void> {
    const log = openSync(join(this.data, "runner.log"), "a");
    const ports = ["--port", String(this.port), "--page-port", String(pagePort)];
    this.#process = spawn(
      PYTHON,
      ["-m", "action_assistant", "runner", "--data", join(this.data, "data"), ...ports],
      {
        cwd: ROOT,
        stdio: ["ignore", log, log],
        env: { ...process.env, ACTION_ASSISTANT_TOKEN: TOKEN },
      },
    );
    for (let tries = 0; !(await answers(`${this.url}/readyz`)); tries += 1) {
      if (tries > 1200 || this.#process.exitCode !== null) throw new Error("hall B does not begin");
      await pause(50);
    }
  }

  freeze(): void {
    this.#process?.kill("SIGSTOP");
  }

  thaw(): void {
    this.#process?.kill("SIGCONT");
  }

  async dispose(): Promise<void> {
    const child = this.#process;
    this.#process = undefined;
    if (child !== undefined && child.exitCode === null) {
      const gone = new Promise((done) => child.once("exit", done));
      child.kill("SIGKILL");
      await gone;
    }
    rmSync(this.data, { recursive: true, force: true, maxRetries: 5 });
  }
}

/** Start a product whose page leads two halls. */
export async function startTwoHalls(product: Product, second: SecondRunner): Promise<void> {
  second.port = await freePort();
  await product.start((port) => [
    ...["--runner", `Hall A=http://127.0.0.1:${port + 1}`],
    ...["--runner", `Hall B=${second.url}`],
  ]);
  await second.start(product.port);
}
