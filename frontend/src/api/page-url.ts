/** Address of the page on its server: the root, or below a path of a proxy. */

/**
 * Return the address that the server wrote into the page. Without one (in tests, under `npm run
 * dev`) it is the root.
 */
function written(): string {
  const found = globalThis.document?.querySelector<HTMLMetaElement>('meta[name="root"]')?.content;
  return found?.startsWith("/") ? found.replace(/\/$/, "") : "";
}

/** "" or as "/temoto". */
export const basePath: string = written();

/** The address on the page's own server of what lies at a path below its root, as "/api/graphs". */
export function serverPath(path: string): string {
  return basePath + path;
}

/** The path of the page that shows one thing by a link, as the server's `VIEW`. */
const VIEW = "/view";

/** Set if this is the page of a link: it has no session, and no STOP. */
export const isViewPage: boolean = globalThis.location?.pathname === serverPath(VIEW);

/** Return the address of the page without a slash at its end. */
export function pageUrl(): string {
  return globalThis.location.origin + basePath;
}

/**
 * Return the address of a place of the documentation that comes with the server, as
 * "robots.html#registering-one".
 */
export function helpUrl(place: string): string {
  return serverPath(`/help/${place}`);
}

/** Return whether browsers block the address: an encrypted page may not load unencrypted content. */
export function isBlocked(runner: string): boolean {
  return globalThis.location?.protocol === "https:" && runner.startsWith("http:");
}
