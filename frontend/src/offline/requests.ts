/** Decides what the service worker does with a request: pure, for the worker and its tests. */

/** Beside the page on its origin: answered by the server or by nobody, and never kept. */
const NOT_THE_PAGE = ["api/", "runner/", "schema", "help", "view", "healthz", "readyz", "metrics"];

export type Handling =
  /** The browser asks the server, as if there were no worker. */
  | "pass"
  /** The page itself: the server's, and what is kept only when no server answers. */
  | "page"
  /** A part of the page whose name says its content: what is kept is what the server has. */
  | "part"
  /** A sign beside the page: the server's, and what is kept when no server answers. */
  | "sign";

export interface AskedFor {
  readonly method: string;
  readonly mode: string;
  readonly url: string;
}

/** Returns what the service worker does with a request. `scope`: where the page lies, as "https://host/temoto/". */
export function handlingOf({ method, mode, url }: AskedFor, scope: string): Handling {
  if (method !== "GET" || !url.startsWith(scope)) return "pass";
  const below = url.slice(scope.length).replace(/[?#].*$/, "");
  if (NOT_THE_PAGE.some((start) => below.startsWith(start))) return "pass";
  if (/^([^/]+\/)+(api\/|(healthz|readyz|metrics)$)/.test(below)) return "pass"; // of a further runner
  if (mode === "navigate") return "page";
  if (below.startsWith("assets/")) return "part";
  return /^[\w-]+\.(svg|png|webmanifest)$/.test(below) ? "sign" : "pass";
}

/** Returns true if a proxy answered for a server that it does not reach. */
export function isServerGone(status: number): boolean {
  return status === 502 || status === 503 || status === 504;
}

const PREFIX = "page-";

/** The store of one version of the page. */
export const storeName = (version: string): string => PREFIX + version;

/**
 * The stores that may go, of those there are in the order in which they were made: pages that are
 * still open may need parts of the version before this one.
 */
export function outdated(stores: readonly string[], version: string): string[] {
  const others = stores.filter((name) => name.startsWith(PREFIX) && name !== storeName(version));
  return others.slice(0, -1);
}
