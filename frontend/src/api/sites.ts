/**
 * The sites of this page: its runners, if there are several, each with robots of its own. They know nothing
 * of each other; the page knows which of them has a robot or a run. What chooses is loaded with several
 * runners only (`site-requests.ts`); the address of the first one stands for all.
 */

export interface Site {
  readonly name: string;
  /** The URL of its runner, without a slash at the end. */
  readonly url: string;
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

/** Knows which site has what. */
export interface SiteRouter {
  readonly sites: readonly Site[];
  /** Sends a request to the sites that it is meant for. `route`: method and path, as OpenAPI has it. */
  ask(route: string, sent: UnsentRequest, ask: AskSite): Promise<unknown>;
  /** Returns the site of a run, a piece of one or something else with an id, as far as the page knows it. */
  siteOfId(id: string): Site | undefined;
  /** Returns the sites that have a robot of this name. */
  sitesOfRobot(robot: string): readonly Site[];
  /** Returns why a robot cannot get this name at a site; "" if it can. */
  takenElsewhere(robot: string, url: string): string;
}

let router: SiteRouter | undefined;

/** Set what chooses the site of each request; undefined with one runner. */
export function setSiteRouter(found: SiteRouter | undefined): void {
  router = found;
}

/** Return the router for an address that stands for all sites; undefined for the address of one runner. */
export function routerOf(address: string): SiteRouter | undefined {
  return router?.sites[0]?.url === address ? router : undefined;
}

/** Return the site of a URL. */
export function siteOfUrl(url: string): Site | undefined {
  return router?.sites.find((site) => url.startsWith(`${site.url}/`));
}

/** Return whether a URL is of another site than the first. */
export function isFurtherSite(url: string): boolean {
  const site = siteOfUrl(url);
  return site !== undefined && site !== router?.sites[0];
}

/** Return the site of a run or of something else with an id; undefined with one runner. */
export function siteOfId(id: string): Site | undefined {
  return router?.siteOfId(id);
}

/** Return the runner that has a run or a repeat, for an address that stands for all. */
export function runnerOfRun(address: string, run: string): string {
  return routerOf(address)?.siteOfId(run)?.url ?? address;
}

/** Return the runner that has a robot, for an address that stands for all. */
export function runnerOfRobot(address: string, robot: string): string {
  return routerOf(address)?.sitesOfRobot(robot)[0]?.url ?? address;
}

/** Return why a robot cannot get this name at a site; "" if it can, and with one runner. */
export function takenElsewhere(robot: string, url: string): string {
  return router?.takenElsewhere(robot, url) ?? "";
}
