/** Where the page lies on its server: at the root, or below a path that a proxy gave it. */

/** What the server wrote into the page. Without one (in tests, under `npm run dev`) it is the root. */
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

/** Of the page, without a slash at its end: what links to it begin with. */
export function pageUrl(): string {
  return globalThis.location.origin + basePath;
}

/** Of a place of the documentation that comes with the server, as "robots.html#registering-one". */
export function helpUrl(place: string): string {
  return serverPath(`/help/${place}`);
}
