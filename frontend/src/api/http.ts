/** Requests to editor and runner, and how they refuse. */
import { hearAnswer, tick } from "../clock/server-clock";
import { isolated } from "../words/isolated";
import { serverPath } from "./page-url";
import type { EditorApi } from "./schema/editor";
import { isFurtherSite, siteOfUrl } from "./sites";

/** RFC 9457 as both processes answer it. */
export type ProblemDetails = EditorApi["ProblemDetails"];

/** The server answered, and the answer is no. */
export class Refusal extends Error {
  readonly details: ProblemDetails;
  constructor(details: ProblemDetails) {
    super(details.detail || details.title);
    this.name = "Refusal";
    this.details = details;
  }
}

/** Nobody answered. */
class Unreachable extends Error {
  constructor(who: string) {
    super(`${who} does not answer.`);
    this.name = "Unreachable";
  }
}

/** Return the runner of a site in words; "The runner" where there is only one. */
export function runnerWords(site: string | undefined): string {
  return site === undefined ? "The runner" : `The runner of ${isolated(site)}`;
}

/** Return whether the outcome of a failed request is unknown: no server refused it. */
export function isOutcomeUnknown(error: unknown): boolean {
  if (!(error instanceof Refusal)) return true;
  const { status, type } = error.details;
  return status >= 500 && (status !== 503 || type === UNKNOWN_TYPE);
}

/** The `type` of an answer that none of ours gave, as a proxy's. */
const UNKNOWN_TYPE = "refused";

/** Return whether a proxy answered in place of the server, since it cannot reach it. */
export function isProxyFault(error: Refusal): boolean {
  const { status, type } = error.details;
  return type === UNKNOWN_TYPE && status >= 502 && status <= 504;
}

const STORAGE = ["database", "writer", "schema", "disk"] as const;

/** Return why the editor can store nothing at the moment, in its words; null if it can, or does not say. */
export async function storageFault(): Promise<string | null> {
  const answer = await send("/readyz", {}).catch(() => null);
  const body: unknown = await answer?.json().catch(() => null);
  const parts = (body as { parts?: Readonly<Record<string, string | null>> } | null)?.parts;
  const faults = STORAGE.map((part) => parts?.[part]).filter((fault) => fault != null);
  return faults.length === 0 ? null : faults.join(" ");
}

/** Return whether one of our servers refused a request: sending it again will not help. */
export function isFinal(error: unknown): boolean {
  if (!(error instanceof Refusal)) return false;
  return error.details.status < 500 && error.details.type !== UNKNOWN_TYPE;
}

export interface RequestOptions {
  method?: "GET" | "POST" | "PUT" | "PATCH" | "DELETE";
  /** An object is sent as JSON, a string as it is (also JSON), and a file as its bytes. */
  body?: unknown;
  signal?: AbortSignal | undefined;
  /** Milliseconds until an answer must be there. */
  timeoutMs?: number;
  /** Goes on when the page is closed meanwhile; only for small bodies. */
  keepalive?: boolean;
  /** The key of a link that shows one thing, sent in place of the session of this browser. */
  viewKey?: string;
}

const PATIENCE = 20_000; // ms
const SESSION = "/api/session";

/**
 * Return whether the editor knows this session; "unsure" if it does not answer.
 * If it does not, the page hears that the session has ended.
 */
export async function isSignedIn(): Promise<"yes" | "no" | "unsure"> {
  const init: RequestInit = { credentials: "include", signal: AbortSignal.timeout(5_000) };
  const answer = await fetch(serverPath(SESSION), init).catch(() => null);
  if (answer?.status === 401) sessionEnd.notice();
  return answer === null ? "unsure" : answer.status === 401 ? "no" : "yes";
}

/** The editor tells when a session has ended. The runner may only lack what the cookie is for. */
async function heard401(isEditor: boolean): Promise<void> {
  if (isEditor || (await isSignedIn()) === "unsure") sessionEnd.notice();
}

const ENDED: ProblemDetails = {
  type: "unauthenticated",
  title: "Sign in first",
  status: 401,
  detail: "Your session has ended.",
};

/** Looks that would only be refused again: what refetches itself would ask for ever. */
function isIdle(url: string, ask: RequestOptions): boolean {
  return sessionEnd.now() && (ask.method ?? "GET") === "GET" && !url.startsWith(SESSION);
}

/** HTTP status codes that only a proxy answers. */
const BY_PROXIES: ReadonlyMap<number, string> = new Map([
  [413, "Too large for the proxy in front of the server (nginx: client_max_body_size 10m)."],
  [502, "The proxy in front of the server cannot reach the server (502)."],
  [503, "The proxy in front of the server cannot reach the server (503)."],
  [504, "The server did not answer its proxy in time (504)."],
]);

async function problemOf(response: Response): Promise<ProblemDetails> {
  const fallback = {
    type: UNKNOWN_TYPE,
    title: response.statusText || "Refused",
    status: response.status,
    detail: BY_PROXIES.get(response.status) ?? `The server answered ${response.status}.`,
  };
  try {
    const body: unknown = await response.json();
    if (typeof body !== "object" || body === null) return fallback;
    return { ...fallback, ...body };
  } catch {
    return fallback;
  }
}

async function send(url: string, ask: RequestOptions): Promise<Response> {
  if (isIdle(url, ask)) throw new Refusal(ENDED);
  const isEditor = url.startsWith("/");
  const patience = AbortSignal.timeout(ask.timeoutMs ?? PATIENCE);
  const init: RequestInit = {
    method: ask.method ?? "GET",
    credentials: ask.viewKey === undefined ? "include" : "omit",
    keepalive: ask.keepalive ?? false,
    signal: ask.signal ? AbortSignal.any([ask.signal, patience]) : patience,
  };
  if (ask.viewKey !== undefined) init.headers = { authorization: `Bearer ${ask.viewKey}` };
  if (ask.body instanceof Blob) init.body = ask.body;
  else if (ask.body !== undefined) {
    init.headers = { "content-type": "application/json" };
    init.body = typeof ask.body === "string" ? ask.body : JSON.stringify(ask.body);
  }
  try {
    const asked = tick();
    const response = await fetch(isEditor ? serverPath(url) : url, init);
    if (isEditor) hearAnswer(response.headers.get("date"), asked); // others hide it from this page
    if (response.status === 401 && ask.viewKey === undefined) {
      if (!isFurtherSite(url)) void heard401(isEditor);
      else void isSignedIn(); // a site that does not know the session ends it nowhere else
    }
    return response;
  } catch (error) {
    if (ask.signal?.aborted) throw error;
    throw new Unreachable(isEditor ? "The editor" : runnerWords(siteOfUrl(url)?.name));
  }
}

/** Return the response of a route. Throws `Refusal` or `Unreachable`. */
export async function fetchAnswer(url: string, request: RequestOptions = {}): Promise<Response> {
  const response = await send(url, request);
  if (response.ok) return response;
  const refusal = new Refusal(await problemOf(response));
  if ((request.method ?? "GET") !== "GET") noteUnconfirmed(refusal.details);
  throw refusal;
}

/** Return the text that a route answers, unparsed, so that `5` and `5.0` stay different. */
export async function fetchText(url: string, request: RequestOptions = {}): Promise<string> {
  return (await fetchAnswer(url, request)).text();
}

/** Return one sentence for people about an error, whatever it is. */
export function errorText(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}

/** Have the page ask the person to confirm who they are, if that is why something was refused. */
function noteUnconfirmed({ where }: ProblemDetails): void {
  const { item, engines, robots } = { ...where } as Readonly<Record<string, unknown>>;
  const each = Object.entries(engines ?? {}) as [string, { item?: string; robots?: object }][];
  const asking = each.filter(([, why]) => why.item === "confirm");
  const led = asking.flatMap(([name, why]) => (why.robots ? Object.keys(why.robots) : [name]));
  if (item === "confirm") unconfirmed.set(Object.keys(robots ?? {}));
  else if (led.length > 0) unconfirmed.set(led);
}

type Listener = () => void;

const confirmListeners = new Set<Listener>();
let asking: readonly string[] | null = null;

/** Robots that want to know that it is this person, none of them for other things; null if nothing asks. */
export const unconfirmed = {
  now: (): readonly string[] | null => asking,
  subscribe: (listener: Listener): (() => void) => {
    confirmListeners.add(listener);
    return () => confirmListeners.delete(listener);
  },
  set: (robots: readonly string[] | null): void => {
    asking = robots;
    for (const listener of [...confirmListeners]) listener();
  },
};

const listeners = new Set<Listener>();
let ended = false;

function put(next: boolean): void {
  if (ended === next) return;
  ended = next;
  for (const listener of [...listeners]) listener();
}

/** Usable without React: `subscribe` and `now` fit `useSyncExternalStore`. */
export const sessionEnd = {
  now: (): boolean => ended,
  subscribe: (listener: Listener): (() => void) => {
    listeners.add(listener);
    return () => listeners.delete(listener);
  },
  /** A server has answered that nobody is signed in. */
  notice: (): void => put(true),
  /** A person has signed in. */
  clear: (): void => put(false),
};
