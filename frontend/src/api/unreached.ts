/** Finds out why a runner is not reached. Loaded then: STOP does not wait for it. */
import { isSignedIn } from "./http";
import { isBlocked, pageUrl } from "./page-url";

/**
 * `ended`: nobody is signed in any more. `strange`: asking again soon is of no use. `mute`: it answers,
 * so a Stop arrives, but what becomes of it is not seen.
 */
export interface UnreachableReason {
  readonly kind: "ended" | "strange" | "mute" | "silent";
  readonly why: string;
}

const PATIENCE = 3_000; // ms

/** Return why a socket did not open: a browser does not tell. */
export async function findUnreachableReason(runner: string): Promise<UnreachableReason> {
  if (isBlocked(runner)) {
    return {
      kind: "strange",
      why: `This page is encrypted and the runner at ${runner} is not, so the browser blocks the connection. A proxy has to serve both: start the server with --public-url ${pageUrl()}/ and forward everything below runner/ to the runner’s port.`,
    };
  }
  const refused = refusedByPolicy(runner);
  const answer = await asked(`${runner}/api/reach`);
  if (await refused())
    return {
      kind: "strange",
      why: `This page was loaded before the runner at ${runner} was named, so the browser does not let it connect there: reload the page.`,
    };
  if (answer === null)
    return { kind: "silent", why: `The runner does not answer.${stray(runner)}` };
  if (answer.status === 401) return unknownTo(runner);
  if (!answer.ok || !/json/.test(answer.headers.get("content-type") ?? "")) {
    return { kind: "strange", why: await astray(runner, answer) };
  }
  return {
    kind: "mute",
    why: "The runner answers, but a live connection to it cannot be opened: a proxy in between has to pass WebSockets on (nginx: proxy_http_version 1.1, and the headers Upgrade and Connection).",
  };
}

/**
 * Watches whether the policy of the page refuses a request: it names the runners of the time at which the page was
 * loaded. Return a function that ends that and says whether it did.
 */
function refusedByPolicy(runner: string): () => Promise<boolean> {
  let isRefused = false;
  const listen = ({ blockedURI }: SecurityPolicyViolationEvent) => {
    isRefused ||= blockedURI.startsWith(runner);
  };
  globalThis.document?.addEventListener("securitypolicyviolation", listen);
  return async () => {
    await new Promise((done) => setTimeout(done)); // the event may come after the refusal
    globalThis.document?.removeEventListener("securitypolicyviolation", listen);
    return isRefused;
  };
}

async function asked(url: string): Promise<Response | null> {
  const init: RequestInit = { credentials: "include", signal: AbortSignal.timeout(PATIENCE) };
  return fetch(url, init).catch(() => null);
}

async function unknownTo(runner: string): Promise<UnreachableReason> {
  const known = await isSignedIn();
  if (known === "no") return { kind: "ended", why: "Your session has ended." };
  const here = known === "yes" ? ", though the editor does" : "";
  return {
    kind: "strange",
    why: `The runner at ${runner} does not know your session${here}. The runner needs the editor’s token and the address of this page (behind a proxy: --public-url).`,
  };
}

async function astray(runner: string, answer: Response): Promise<string> {
  const problem: unknown = await answer.json().catch(() => null);
  const detail = (problem as { detail?: unknown } | null)?.detail;
  if (typeof detail === "string") return detail;
  return `The program that answers at ${runner} is not the runner (${answer.status}): the proxy has to forward this address to the runner’s port.`;
}

/** A server that was told another host takes this page for one of that host. */
function stray(runner: string): string {
  const { hostname } = new URL(runner);
  const own = globalThis.location?.hostname ?? hostname;
  if (own === hostname) return "";
  return ` The server says that it is at ${hostname}, and this page is at ${own}: the proxy has to pass on the Host header, and the server needs --public-url ${pageUrl()}/.`;
}
