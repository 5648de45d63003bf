/**
 * The sites of this page: its runners, if there are several, each with robots of its own. They know nothing
 * of each other; the page knows which of them has a robot or a run. What chooses is loaded with several
 * runners only (`site-requests.ts`); the address of the first one stands for all.
 */

export interface Site {
  readonly name: string;
  /** The URL of its runner, without a slash at the end. */
  readonly url: string;
  /** Set if the editor does not name it any more: nothing is started there. */
  readonly isUnlisted?: true;
}

/** Sends the request to one site, perhaps with another query or body, and returns the JSON of its answer. */
export type AskSite = (
  site: Site,
  other?: { readonly query?: URLSearchParams; readonly body?: unknown },
) => Promise<unknown>;

/** A request before its site is chosen. */
export interface UnsentRequest {
  readonly path?: Readonly<Record<string, string | number>>;
  readonly query?: Readonly<Record<string, unknown>> | URLSearchParams;
  readonly body?: unknown;
}

/** A run, as far as its age is concerned. */
export interface AgedRun {
  readonly id: string;
  readonly number: number;
  readonly requested_at: string;
}

/** Knows which site has what. */
export interface SiteRouter {
  /** Sends a request to the sites that it is meant for. `route`: method and path, as OpenAPI has it. */
  ask(route: string, sent: UnsentRequest, ask: AskSite): Promise<unknown>;
  /** Returns the site of a run, a piece of one or something else with an id, as far as the page knows it. */
  siteOfId(id: string): Site | undefined;
  /** Returns the sites that have a robot of this name. */
  sitesOfRobot(robot: string): readonly Site[];
  /** Returns why a robot cannot get this name at a site; "" if it can. */
  takenElsewhere(robot: string, url: string): string;
  /** Returns the milliseconds from a time by the clock of a site to the same moment by the page's. */
  shiftOf(site: Site | undefined): number;
  /** Compares the moments of two runs, each by the clock of its runner. */
  newerFirst(a: AgedRun, b: AgedRun): number;
}

let sites: readonly Site[] = [];
let router: SiteRouter | undefined;

/** Set the sites, none with one runner. Stop needs no router. */
export function setSites(found: readonly Site[]): void {
  sites = found;
}

export const allSites = (): readonly Site[] => sites;

/** Set what chooses the site of each request, once it is there. */
export function setSiteRouter(found: SiteRouter | undefined): void {
  router = found;
}

/** Return the router; undefined with one runner. */
export const routing = (): SiteRouter | undefined => (sites.length > 0 ? router : undefined);

/** Return the router for an address that stands for all sites; undefined for the address of one runner. */
export function routerOf(address: string): SiteRouter | undefined {
  return sites[0]?.url === address ? router : undefined;
}

/** Return the site of a URL. */
export function siteOfUrl(url: string): Site | undefined {
  return sites.find((site) => url.startsWith(`${site.url}/`));
}

/** Return whether a URL is of another site than the first. */
export function isFurtherSite(url: string): boolean {
  const site = siteOfUrl(url);
  return site !== undefined && site !== sites[0];
}

/** Return the site of a run or of something else with an id; undefined with one runner. */
export function siteOfId(id: string): Site | undefined {
  return routing()?.siteOfId(id);
}

/**
 * Compare two runs for `sort`, the newer one first. A runner counts its own runs, so that the numbers of several
 * say nothing about each other: there the moments count.
 */
export function newerFirst(a: AgedRun, b: AgedRun): number {
  return routing()?.newerFirst(a, b) ?? b.number - a.number;
}
