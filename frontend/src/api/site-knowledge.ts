/** Knows which site has which robots and runs, by the live sockets and by earlier answers. */
import { isolated } from "../words/isolated";
import type { Site } from "./sites";

/** The robots and runs that a live socket knows of a site. `robots`: null until the site has said them. */
export interface SiteKnowledge {
  readonly isLive: boolean;
  readonly robots: ReadonlySet<string> | null;
  hasRun(id: string): boolean;
}

let all: readonly Site[] = [];
let knowledge: (site: Site) => SiteKnowledge;
/** The site of each run, repeat and entry of the queue that an answer has shown, and of each start, by its id. */
const seen = new Map<string, Site>();

/** Set the sites. `know` tells what the live socket of a site says. */
export function setSites(found: readonly Site[], know: (site: Site) => SiteKnowledge): void {
  all = found;
  knowledge = know;
  seen.clear();
}

export const allSites = (): readonly Site[] => all;

/** Remember that a site has a run, or something else with an id. */
export function noteSite(id: string, site: Site): void {
  seen.set(id, site);
}

export function siteOfId(id: string): Site | undefined {
  const [run = id] = id.split(".");
  return all.find((site) => knowledge(site).hasRun(run)) ?? seen.get(run);
}

export function sitesOfRobot(robot: string): Site[] {
  return all.filter((site) => knowledge(site).robots?.has(robot));
}

/** Return the sites that have not said which robots they have. */
export function mutedSites(): Site[] {
  return all.filter((site) => knowledge(site).robots === null);
}

/** A start by a name must not move another robot of that name. */
export function takenElsewhere(robot: string, url: string): string {
  const others = all.filter((site) => site.url !== url);
  const has = others.find((site) => knowledge(site).robots?.has(robot));
  if (has) {
    return `${isolated(robot)} is registered at ${isolated(has.name)}: the name of a robot is unique over all sites.`;
  }
  const silent = others.find((site) => !knowledge(site).isLive);
  if (silent === undefined) return "";
  return `${isolated(silent.name)} does not say its robots, and one of them may be called ${isolated(robot)} as well. Register it when ${isolated(silent.name)} answers.`;
}
