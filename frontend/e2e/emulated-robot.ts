/** Stand-in robots over real rclpy for browser tests, and somebody else on their domain. */

import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, readFileSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";

const ROOT = resolve(import.meta.dirname, "../..");
const PYTHON = process.env.ACTION_ASSISTANT_RUNNER_PYTHON ?? join(ROOT, ".venv-ros/bin/python");

/** Why there can be no robots here; "" when there can. */
export const NO_ROS = existsSync(PYTHON) ? "" : "rclpy is not there: make ros builds it";

/** A domain for this process alone, away from those that people use. */
export const DOMAIN = 120 + (process.pid % 80);

/** The domain of a second hall: a runner would see that of the first one as somebody else. */
export const SECOND_DOMAIN = 200 + (process.pid % 30);

/** A process that speaks ROS 2. */
class Speaker {
  #process: ChildProcess | undefined;
  #said = "";

  protected begin(args: string[], input = ""): void {
    const child = spawn(PYTHON, args, {
      cwd: ROOT,
      env: { ...process.env, ROS_DOMAIN_ID: String(DOMAIN) },
      stdio: ["pipe", "pipe", "pipe"],
    });
    child.stdout.on("data", (data) => {
      this.#said += String(data);
    });
    child.stderr.on("data", (data) => {
      this.#said += String(data);
    });
    child.stdin.end(input);
    this.#process = child;
  }

  get said(): string {
    return this.#said;
  }

  /** It leaves as it should: the others hear of it at once. */
  end(): Promise<void> {
    return this.#signal("SIGTERM");
  }

  /** SIGKILL: to the others it seems to be there for up to twenty seconds more. */
  kill(): Promise<void> {
    return this.#signal("SIGKILL");
  }

  /** SIGSTOP: it is there, and neither hears nor answers. */
  freeze(): void {
    this.#process?.kill("SIGSTOP");
  }

  /** SIGCONT. */
  thaw(): void {
    this.#process?.kill("SIGCONT");
  }

  async #signal(signal: NodeJS.Signals): Promise<void> {
    const child = this.#process;
    this.#process = undefined;
    if (child === undefined || child.exitCode !== null) return;
    const gone = new Promise((done) => child.once("exit", done));
    child.kill(signal);
    await gone;
  }
}

/** Whatever answers on a path of its own, under a name. */
abstract class Engine extends Speaker {
  readonly name: string;

  constructor(name: string) {
    super();
    this.name = name;
  }

  /** Where it answers. */
  get path(): string {
    return `/${this.name}/umrf_graph_get`;
  }
}

/** A stand-in whose actions do as `behaviours` say, by their names: always, or call by call. `quirks`:
 * `NAME=VALUE`. Its snapshots all arrive: a lost one may leave a Stop unconfirmed, by chance. */
export class StandIn extends Engine {
  private readonly actions: string;
  private readonly domain: number;

  /** `actions`: a folder with the files of those that it has; without one it has all. */
  constructor(name: string, actions = "", domain = DOMAIN) {
    super(name);
    this.actions = actions;
    this.domain = domain;
  }

  start(folder: string, behaviours: Record<string, object | object[]>, ...quirks: string[]): void {
    const script = join(folder, `${this.name}.json`);
    const each = Object.entries(behaviours).map(([name, behaviour]) => [name, [behaviour].flat()]);
    writeFileSync(script, JSON.stringify({ behaviours: Object.fromEntries(each) }));
    this.begin([
      ...["-m", "action_assistant", "simulate-robot", this.name],
      ...["--domain", String(this.domain), "--namespace", this.name, "--script", script],
      ...["loss=0", ...quirks].flatMap((quirk) => ["--quirk", quirk]),
      ...(this.actions === "" ? [] : ["--actions", this.actions]),
    ]);
  }
}

/** An engine that was built with another generation of messages. */
export class OlderEngine extends Engine {
  start(): void {
    this.begin(["-c", readFileSync(join(import.meta.dirname, "old_engine.py"), "utf8"), this.name]);
  }
}

/** Somebody who publishes one start from elsewhere, and then stays on the domain for a while. */
export class Stranger extends Speaker {
  /** `listeners`: how many hear starts on the domain, the runner among them. */
  start(robot: string, graph: string, listeners: number): void {
    const code = readFileSync(join(import.meta.dirname, "foreign_start.py"), "utf8");
    this.begin(["-c", code, robot, String(listeners)], graph);
  }
}
