/** Knows which site has which robots and runs, by the live sockets and by earlier answers. */
import { isolated } from "../words/isolated";
import { allSites, type Site } from "./sites";

/** The robots and runs that a live socket knows of a site. `robots`: null until the site has said them. */
export interface SiteKnowledge {
  readonly isLive: boolean;
  readonly robots: ReadonlySet<string> | null;
  hasRun(id: string): boolean;
  /** Milliseconds from a time by the site's clock to the same moment by the page's. */
  readonly shift: number;
}

let knowledge: (site: Site) => SiteKnowledge;
/** The URL of the site of each run, repeat and entry of the queue that an answer has shown, and of each start, by its id. */
const seen = new Map<string, string>();

/** `know` tells what the live socket of a site says. */
export function setKnowledge(know: (site: Site) => SiteKnowledge): void {
  knowledge = know;
  seen.clear();
}

/** Remember that a site has a run, or something else with an id. */
export function noteSite(id: string, site: Site): void {
  seen.set(id, site.url);
}

export function siteOfId(id: string): Site | undefined {
  const [run = id] = id.split(".");
  const all = allSites();
  const url = seen.get(run);
  return all.find((site) => knowledge(site).hasRun(run)) ?? all.find((site) => site.url === url);
}

export function sitesOfRobot(robot: string): Site[] {
  return allSites().filter((site) => knowledge(site).robots?.has(robot));
}

export function shiftOf(site: Site | undefined): number {
  return site === undefined ? 0 : knowledge(site).shift;
}

/** Return the sites that have not said which robots they have. */
export function mutedSites(): Site[] {
  return allSites().filter((site) => knowledge(site).robots === null);
}

/** A start by a name must not move another robot of that name. */
export function takenElsewhere(robot: string, url: string): string {
  const others = allSites().filter((site) => site.url !== url);
  const has = others.find((site) => knowledge(site).robots?.has(robot));
  if (has) {
    return `${isolated(robot)} is registered at ${isolated(has.name)}: the name of a robot is unique over all sites.`;
  }
  const silent = others.find((site) => !knowledge(site).isLive);
  if (silent === undefined) return "";
  return `${isolated(silent.name)} does not say its robots, and one of them may be called ${isolated(robot)} as well. Register it when ${isolated(silent.name)} answers.`;
}
