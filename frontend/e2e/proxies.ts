/** The proxies of the documentation, with the files of the documentation, in front of a product. */

import { type ChildProcess, execFileSync, spawn } from "node:child_process";
import { mkdtempSync, openSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { connect } from "node:net";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pause } from "./product";

const DOCUMENTED = resolve(import.meta.dirname, "../../docs/proxy");
export const NAME = "robots.test";
export type Kind = "nginx" | "caddy";

/** Where Debian has it; null when it is not installed. */
function program(kind: Kind): string | null {
  try {
    const path = `${process.env.PATH}:/usr/sbin:/usr/local/sbin`;
    return execFileSync("sh", ["-c", `command -v ${kind}`], { env: { PATH: path } })
      .toString()
      .trim();
  } catch {
    return null;
  }
}

/** Why a proxy cannot be tried here; "" when it can. */
export function missing(kind: Kind): string {
  return program(kind) === null ? `${kind} is not installed` : "";
}

export class ProxyServer {
  readonly port: number;
  private readonly kind: Kind;
  private readonly path: string;
  private readonly folder = mkdtempSync(join(tmpdir(), "action-assistant-proxy-"));
  private process: ChildProcess | undefined;

  /** `path` is that of the page: "" or as "/temoto". */
  constructor(kind: Kind, path: string, port: number) {
    this.kind = kind;
    this.path = path;
    this.port = port;
  }

  /** Of the page, without a slash at its end. */
  get url(): string {
    return `https://${NAME}:${this.port}${this.path}`;
  }

  /** Starts it before the two processes. `change` is made to the documented file. */
  async start(editor: number, change = (text: string) => text): Promise<void> {
    const key = join(this.folder, "key.pem");
    const chain = join(this.folder, "chain.pem");
    const subject = ["-subj", `/CN=${NAME}`, "-addext", `subjectAltName=DNS:${NAME}`];
    const kind = ["-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"];
    const files = ["-keyout", key, "-out", chain];
    execFileSync("openssl", ["req", ...kind, ...files, ...subject], { stdio: "ignore" });
    const name = this.kind === "nginx" ? "nginx.conf" : "Caddyfile";
    const documented = readFileSync(join(DOCUMENTED, name), "utf8")
      .replaceAll("127.0.0.1:8000", `127.0.0.1:${editor}`)
      .replaceAll("127.0.0.1:8001", `127.0.0.1:${editor + 1}`)
      .replace(this.path === "" ? /^\tredir.*$/m : "", "")
      .replaceAll("/temoto", this.path);
    const command = this.kind === "nginx" ? this.nginx : this.caddy;
    const [argument, ...more] = command(change(documented), chain, key);
    const log = openSync(join(this.folder, "log"), "a");
    this.process = spawn(program(this.kind) ?? this.kind, [argument ?? "", ...more], {
      stdio: ["ignore", log, log],
      env: { ...process.env, XDG_DATA_HOME: this.folder, XDG_CONFIG_HOME: this.folder },
    });
    while (!(await listens(this.port))) {
      if (this.process.exitCode !== null) {
        throw new Error(readFileSync(join(this.folder, "log"), "utf8"));
      }
      await pause(50);
    }
  }

  private readonly nginx = (documented: string, chain: string, key: string): string[] => {
    const server = documented
      .replace("listen 443", `listen 127.0.0.1:${this.port}`)
      .replace("robots.example.org;", `${NAME};`)
      .replace(/ssl_certificate .*/, `ssl_certificate ${chain};`)
      .replace(/ssl_certificate_key .*/, `ssl_certificate_key ${key};`);
    const kinds = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"];
    const temporary = kinds.map((each) => `${each}_temp_path ${this.folder}/${each};`).join(" ");
    const user = process.getuid?.() === 0 ? "user root;" : "";
    const whole = `${user} pid ${this.folder}/pid; error_log stderr; events {}
http { access_log off; ${temporary}\n${server} }`;
    writeFileSync(join(this.folder, "nginx.conf"), whole);
    return ["-p", this.folder, "-c", join(this.folder, "nginx.conf"), "-g", "daemon off;"];
  };

  private readonly caddy = (documented: string, chain: string, key: string): string[] => {
    const host = `${NAME}:${this.port} {\n\tbind 127.0.0.1\n\ttls ${chain} ${key}`;
    const server = documented.replace(/^robots\.example\.org \{$/m, host);
    writeFileSync(
      join(this.folder, "Caddyfile"),
      `{\n\tadmin off\n\tauto_https disable_redirects\n}\n${server}`,
    );
    return ["run", "--config", join(this.folder, "Caddyfile"), "--adapter", "caddyfile"];
  };

  /** It may be started anew, also with another file. */
  async end(): Promise<void> {
    const { process: child } = this;
    this.process = undefined;
    if (child === undefined || child.exitCode !== null) return;
    const gone = new Promise((done) => child.once("exit", done));
    child.kill("SIGTERM");
    await gone;
  }

  async dispose(): Promise<void> {
    await this.end();
    rmSync(this.folder, { recursive: true, force: true, maxRetries: 5 });
  }
}

function listens(port: number): Promise<boolean> {
  return new Promise((done) => {
    const socket = connect(port, "127.0.0.1");
    socket.once("connect", () => {
      socket.destroy();
      done(true);
    });
    socket.once("error", () => done(false));
  });
}
