/** Three editors of one Postgres behind the documented nginx, and a runner. */

import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, mkdtempSync, openSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface, type Interface } from "node:readline";
import { missing } from "./proxies";

const ROOT = resolve(import.meta.dirname, "../..");

/** Why several editors cannot be tried here; "" when they can. */
export function missingParts(): string {
  const versions = existsSync("/usr/lib/postgresql") ? readdirSync("/usr/lib/postgresql") : [];
  return versions.length === 0 ? "Postgres is not installed" : missing("nginx");
}

export class SeveralEditors {
  readonly folder = mkdtempSync(join(tmpdir(), "action-assistant-editors-"));
  url = "";
  token = "";
  editors: readonly string[] = [];
  private child: ChildProcess | undefined;
  private lines: AsyncIterableIterator<string> | undefined;
  private input: Interface | undefined;

  async start(): Promise<void> {
    const log = join(this.folder, "log");
    this.child = spawn(
      join(ROOT, ".venv/bin/python"),
      [join(import.meta.dirname, "several_editors.py"), this.folder],
      { cwd: ROOT, stdio: ["pipe", "pipe", openSync(log, "a")] },
    );
    const { stdout } = this.child;
    if (stdout === null) throw new Error("no output");
    this.input = createInterface(stdout);
    this.lines = this.input[Symbol.asyncIterator]();
    const said = await this.next<{ url: string; token: string; editors: string[] }>().catch(() => {
      throw new Error(readFileSync(log, "utf8"));
    });
    Object.assign(this, said);
  }

  /** kill -9 of one editor, from 0. */
  kill = (n: number) => this.tell<null>(`kill ${n}`);

  /** Start it again, and wait until it answers. */
  again = (n: number) => this.tell<null>(`start ${n}`);

  /** Return which editor has a graph open. */
  owner = (graph: string) => this.tell<number>(`owner ${graph}`);

  private async tell<T>(line: string): Promise<T> {
    this.child?.stdin?.write(`${line}\n`);
    return this.next<T>();
  }

  private async next<T>(): Promise<T> {
    const { value, done } = (await this.lines?.next()) ?? { done: true };
    if (done) throw new Error("it has ended");
    return JSON.parse(value) as T;
  }

  async dispose(): Promise<void> {
    const { child } = this;
    if (child !== undefined && child.exitCode === null) {
      const gone = new Promise((done) => child.once("exit", done));
      child.stdin?.end();
      await gone;
    }
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 5 });
  }
}
