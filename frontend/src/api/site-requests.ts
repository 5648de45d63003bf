/**
 * Sends each request to the site or sites that it is meant for, and joins their answers. What is known of the robots
 * and runs of each site stands here as well: in a file of its own the page would load it with one request more.
 */
import { isolated } from "../words/isolated";
import { errorText, Refusal } from "./http";
import {
  type AgedRun,
  type AskSite,
  allSites,
  type Site,
  type SiteRouter,
  type UnsentRequest,
} from "./sites";
import { noteUnsaid, type UnsaidSite } from "./unsaid-sites";

/** The robots and runs that a live socket knows of a site. `robots`: null until the site has said them. */
interface SiteKnowledge {
  readonly isLive: boolean;
  readonly robots: ReadonlySet<string> | null;
  hasRun(id: string): boolean;
  /** Milliseconds from a time by the site's clock to the same moment by the page's. */
  readonly shift: number;
}

let knowledge: (site: Site) => SiteKnowledge;
/** The site of each run, repeat and entry of the queue that an answer has shown, and of each start, by its id. */
const seen = new Map<string, Site>();

/** `know` tells what the live socket of a site says. */
export function setKnowledge(know: (site: Site) => SiteKnowledge): void {
  knowledge = know;
  seen.clear();
}

/** Remember that a site has a run, or something else with an id. */
export function noteSite(id: string, site: Site): void {
  seen.set(id, site);
}

export function siteOfId(id: string): Site | undefined {
  const [run = id] = id.split(".");
  const all = allSites();
  const then = seen.get(run);
  return (
    all.find((site) => knowledge(site).hasRun(run)) ??
    all.find(({ name }) => name === then?.name) ?? // it may have moved, and another one have its address
    all.find(({ url }) => url === then?.url)
  );
}

function sitesOfRobot(robot: string): Site[] {
  return allSites().filter((site) => knowledge(site).robots?.has(robot));
}

function shiftOf(site: Site | undefined): number {
  return site === undefined ? 0 : knowledge(site).shift;
}

/** Return the sites that have not said which robots they have. */
function mutedSites(): Site[] {
  return allSites().filter((site) => knowledge(site).robots === null);
}

/** A start by a name must not move another robot of that name. */
function takenElsewhere(robot: string, url: string): string {
  const others = allSites().filter((site) => site.url !== url);
  const has = others.find((site) => knowledge(site).robots?.has(robot));
  if (has) {
    return `${isolated(robot)} is registered at ${isolated(has.name)}: the name of a robot is unique over all sites.`;
  }
  const silent = others.find((site) => !knowledge(site).isLive);
  if (silent === undefined) return "";
  return `${isolated(silent.name)} does not say its robots, and one of them may be called ${isolated(robot)} as well. Register it when ${isolated(silent.name)} answers.`;
}

const SIMULATOR = "simulator"; // each runner has one

/** Requests by which runners learn something: each has to. */
const TOLD = new Set([
  "post /api/sessions/ended",
  "post /api/revocations",
  "put /api/members/{person}",
  "put /api/graph-rules",
  "post /api/tokens/records",
  "post /api/tokens/{token}/revoke",
  "post /api/confirmations/records",
  "post /api/approvals",
  "put /api/releases/{version}",
  "delete /api/releases/{version}",
]);

/** Requests whose answers are joined: the names of the lists in the answer, none where it is a list itself. */
const JOINED: Readonly<Record<string, readonly string[]>> = {
  "get /api/labels": [],
  "get /api/questions": ["questions"],
  "get /api/queue": ["entries", "robots"],
  "get /api/repeats": [],
  "get /api/rights": ["robots", "people"],
  "get /api/approvals": [],
  "get /api/approvals/asked": [],
  "get /api/expectations": [],
  "post /api/expectations/check": [],
  "get /api/view-links": [],
};

/** Requests that name robots in their body. */
const OF_ROBOTS = new Set([
  "post /api/runs",
  "post /api/groups",
  "post /api/queue",
  "post /api/repeats",
  "post /api/preflight",
  "post /api/confirmations",
  "post /api/approvals/asked", // the runner that looked at the order knows it in words
]);

/** Send a request to the site or sites that it is meant for. */
const askSites: SiteRouter["ask"] = async (route, sent, ask) => {
  if (route === "delete /api/session") return tellAll(allSites(), ended(ask));
  if (TOLD.has(route)) return tellAll(allSites(), ask);
  if (route === "post /api/robots/{name}/stop") return stopRobot(String(sent.path?.name), ask);
  if (route === "get /api/runs") return listRuns(route, sent, ask);
  if (route === "get /api/comparison") return comparison(sent, askNoting(ask));
  const lists = JOINED[route];
  if (lists !== undefined) return joined(await answersOf(route, lists, ask));
  if (route === "get /api/starts/{request_id}")
    return foundStart(String(sent.path?.request_id), askNoting(ask));
  if (route === "post /api/preflight" && !isLed(sent.body)) return preflights(sent.body, ask);
  if (OF_ROBOTS.has(route)) return askNoting(ask)(listed(siteOfStart(sent.body)));
  const { name, ...ids } = { ...sent.path };
  if (name !== undefined && / \/api\/(queue\/)?robots\//.test(route))
    return ask(siteOf([String(name)]));
  const id = ids.run ?? Object.values(ids)[0] ?? name ?? runIn(sent);
  return id === undefined ? ask(first()) : ofId(String(id), askNoting(ask));
};

/** The site that answers has the runs of its answer, also where its live socket is late or does not open. */
function askNoting(ask: AskSite): AskSite {
  return async (site, other) => {
    const answer = await ask(site, other);
    noteRuns(answer, site);
    return answer;
  };
}

function noteRuns(answer: unknown, site: Site): void {
  if (!isObject(answer)) return;
  const { id, group, runs, others } = answer;
  for (const each of [id, group]) if (typeof each === "string") noteSite(each, site);
  for (const run of [runs, others].flat()) noteRuns(run, site);
}

/** Return the run that a query or body names. */
function runIn({ query, body }: UnsentRequest): unknown {
  const { a } = asRecord(query);
  const { run, from } = asRecord(isObject(body) ? body : {});
  return a ?? run ?? (isObject(from) ? from.run : undefined);
}

function first(): Site {
  const [site] = allSites();
  if (site === undefined) throw new Error("There are no sites.");
  return site;
}

const asRecord = (query: UnsentRequest["query"]): Record<string, unknown> =>
  query instanceof URLSearchParams ? Object.fromEntries(query) : { ...query };

/** Names each site that did not take it; the others have. */
async function tellAll(sites: readonly Site[], ask: AskSite): Promise<unknown> {
  const told = await Promise.allSettled(sites.map((site) => ask(site)));
  const errors = told.flatMap((each) => (each.status === "rejected" ? [each.reason as Error] : []));
  const [error] = errors;
  if (error === undefined) return told[0]?.status === "fulfilled" ? told[0].value : undefined;
  const names = sites
    .filter((_, i) => told[i]?.status === "rejected")
    .map(({ name }) => isolated(name));
  throw new Error(`${names.join(", ")}: ${errors.map(({ message }) => message).join(" ")}`);
}

/** A session that a site does not know any more has ended there. */
function ended(ask: AskSite): AskSite {
  return (site) =>
    ask(site).catch((error) => {
      if (!(error instanceof Refusal) || error.details.status !== 401) throw error;
    });
}

/** No doubt about where a robot is keeps a Stop from it: each site that may have it gets one. */
async function stopRobot(robot: string, ask: AskSite): Promise<unknown> {
  const having = sitesOfRobot(robot);
  if (having.length === 0) return tellAll(allSites(), ask);
  const perhaps = mutedSites().map((site) => ask(site));
  const told = tellAll(having, ask);
  await Promise.allSettled([told, ...perhaps]);
  return told;
}

interface Answer {
  readonly site: Site;
  readonly value: unknown;
}

/** Return an answer that has these lists. Throws an error for another one: a site that is none of ours hides no other. */
function readable(value: unknown, lists: readonly string[]): unknown {
  const parts = lists.length === 0 ? [value] : lists.map((name) => isObject(value) && value[name]);
  if (parts.every((part) => Array.isArray(part) && part.every((each) => each !== null)))
    return value;
  throw new Error("What it says cannot be read.");
}

/** Returns the answers of the sites that answer. Throws the error of the first site if none does. */
async function answersOf(
  route: string,
  lists: readonly string[],
  ask: AskSite,
  otherFor: (site: Site) => Parameters<AskSite>[1] = () => undefined,
): Promise<Answer[]> {
  const sites = allSites();
  const heard = await Promise.allSettled(
    sites.map((site) => ask(site, otherFor(site)).then((value) => readable(value, lists))),
  );
  const answers: Answer[] = [];
  const unsaid: UnsaidSite[] = [];
  sites.forEach((site, i) => {
    const each = heard[i];
    if (each?.status === "fulfilled") answers.push({ site, value: each.value });
    else unsaid.push({ site, why: errorText(each?.reason) });
  });
  noteUnsaid(route, unsaid);
  if (answers.length === 0) throw (heard[0] as PromiseRejectedResult).reason;
  return answers;
}

/** Lists are put behind each other without twins, of numbers the largest counts, of all else the first that is not empty. */
function join(a: unknown, b: unknown): unknown {
  if (Array.isArray(a) && Array.isArray(b)) {
    const known = new Set(a.map((each) => JSON.stringify(each)));
    return [...a, ...b.filter((each) => !known.has(JSON.stringify(each)))];
  }
  if (typeof a === "number" && typeof b === "number") return Math.max(a, b);
  if (typeof a === "boolean" && typeof b === "boolean") return a || b;
  if (isObject(a) && isObject(b)) {
    const keys = new Set([...Object.keys(a), ...Object.keys(b)]);
    return Object.fromEntries([...keys].map((key) => [key, join(a[key], b[key])]));
  }
  return a ?? b;
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

const joined = (answers: readonly Answer[]): unknown =>
  answers.map(({ value }) => value).reduce(join);

async function ofId(id: string, ask: AskSite): Promise<unknown> {
  const site = siteOfId(id);
  if (site !== undefined) return ask(site);
  const muted = mutedSites();
  const ready = allSites().filter((each) => !muted.includes(each));
  return firstThatHas([...ready, ...muted], ask, (found) => noteSite(id, found));
}

/** A runner compares runs of its own. Throws `Refusal` for runs of two sites. */
async function comparison({ query }: UnsentRequest, ask: AskSite): Promise<unknown> {
  const { a, b } = asRecord(query);
  const [one, other] = [siteOfId(String(a)), siteOfId(String(b))];
  if (one !== undefined && other !== undefined && one !== other)
    throw refused(
      `One run is of ${isolated(one.name)}, the other of ${isolated(other.name)}, and a runner knows only its own runs.`,
    );
  return one === undefined && other !== undefined ? ask(other) : ofId(String(a), ask);
}

/** A start that is not found is nowhere only if each site says so. */
async function foundStart(request: string, ask: AskSite): Promise<unknown> {
  const site = siteOfId(request);
  if (site !== undefined) return ask(site);
  const heard = await Promise.allSettled(allSites().map((each) => ask(each)));
  const found = heard.flatMap((each) => (each.status === "fulfilled" ? [each.value] : []));
  const silent = heard.find((each) => each.status === "rejected");
  const isThere = (each: unknown) =>
    isObject(each) &&
    (each.under_way === true || [each.runs].flat().length > 0 || each.queued != null);
  if (silent !== undefined && !found.some(isThere)) throw silent.reason;
  return found.reduce(join);
}

/**
 * Ask one site after the other until one has it: a runner refuses with 404, and without any effect, what it
 * does not have. Where one does not answer, it is not known whether it has it.
 */
async function firstThatHas(
  sites: readonly Site[],
  ask: AskSite,
  found: (site: Site) => void,
): Promise<unknown> {
  const errors: unknown[] = [];
  for (const site of sites) {
    try {
      const answer = await ask(site);
      found(site);
      return answer;
    } catch (error) {
      if (error instanceof Refusal && error.details.status !== 404) throw error;
      errors.push(error);
    }
  }
  throw errors.find((error) => !(error instanceof Refusal)) ?? errors[0];
}

const isLed = (body: unknown): boolean => isObject(body) && body.robots !== undefined;

/** Return the engines that a start, or a question before one, names. */
function enginesIn(body: unknown): string[] {
  if (!isObject(body)) return [];
  const { engine, engines, robots, start } = body;
  if (start !== undefined) return enginesIn(start);
  if (isObject(robots)) return Object.values(robots).map(String);
  const named = [engine, engines, robots].flat().filter((each) => typeof each === "string");
  return named.filter((each) => each !== "conducted");
}

/** Return the sentence that refuses a start on robots of several sites; "" if they are of one. */
function severalSitesReason(engines: readonly string[]): string {
  const robots = [...new Set(engines)].filter((each) => each !== SIMULATOR).sort();
  const homes = robots.map((robot) => [robot, sitesOfRobot(robot)] as const);
  if (new Set(homes.flatMap(([, sites]) => sites)).size < 2) return "";
  const at = homes
    .filter(([, sites]) => sites.length > 0)
    .map(
      ([robot, sites]) =>
        `${isolated(robot)} at ${sites.map(({ name }) => isolated(name)).join(" and ")}`,
    );
  return `One runner leads all robots of a run, and these are of several sites: ${at.join("; ")}.`;
}

function refused(detail: string): Refusal {
  return new Refusal({ type: "conflict", title: "Not possible", status: 409, detail });
}

/** Return the one site of engines. Throws `Refusal` if they are of several, or if that is not known. */
function siteOf(engines: readonly string[]): Site {
  const robots = engines.filter((each) => each !== SIMULATOR);
  const several = severalSitesReason(robots);
  if (several !== "") throw refused(several);
  const muted = mutedSites();
  const unknown = robots.find((robot) => sitesOfRobot(robot).length === 0);
  if (unknown !== undefined && muted.length > 0) {
    const names = muted.map(({ name }) => isolated(name)).join(", ");
    throw refused(`It is not known where ${isolated(unknown)} is: ${names} does not answer.`);
  }
  return robots.flatMap(sitesOfRobot)[0] ?? first();
}

/** Return the site of a start, and remember it by the start's own id: what became of it is asked there. */
function siteOfStart(body: unknown): Site {
  const robots = enginesIn(body).filter((each) => each !== SIMULATOR);
  const start = isObject(body) && isObject(body.start) ? body.start : body;
  const earlier = isObject(start) && isObject(start.from) ? start.from.run : undefined;
  const site =
    (robots.length === 0 && earlier ? siteOfId(String(earlier)) : undefined) ?? siteOf(robots);
  const request = isObject(start) ? start.request_id : undefined;
  if (request !== undefined) noteSite(String(request), site);
  return site;
}

/** Throws `Refusal` for a site that the editor does not name any more: its robots may be another runner's now. */
function listed(site: Site): Site {
  if (site.isUnlisted) throw refused(`${isolated(site.name)}: nothing is started there.`);
  return site;
}

/** Each engine is looked at by its own runner; the answers stand in the order of the engines. */
async function preflights(body: unknown, ask: AskSite): Promise<unknown> {
  const engines = enginesIn(body);
  const bySite = new Map<Site, string[]>();
  for (const engine of engines) {
    const site = siteOf([engine]);
    bySite.set(site, [...(bySite.get(site) ?? []), engine]);
  }
  const looks = await Promise.all(
    [...bySite].map(([site, its]) =>
      ask(site, { body: { ...(body as object), engines: its } }).then((found) =>
        its.map((engine, i) => [engine, (found as unknown[])[i]] as const),
      ),
    ),
  );
  const found = new Map(looks.flat());
  return engines.map((engine) => found.get(engine));
}

/** The last run of each site that the pages up to a run have, by that run's id. */
const cursors = new Map<string, ReadonlyMap<Site, string>>();

/** The newest runs of all sites by time; each site keeps its own order. */
async function listRuns(route: string, { query }: UnsentRequest, ask: AskSite): Promise<unknown> {
  const given = new URLSearchParams(asRecord(query) as Record<string, string>);
  for (const [key, value] of [...given])
    if (value === "undefined" || value === "null") given.delete(key);
  const limit = Number(given.get("limit") ?? Number.POSITIVE_INFINITY);
  const after = cursors.get(given.get("before") ?? "") ?? new Map<Site, string>();
  const answers = await answersOf(route, [], ask, (site) => {
    const own = new URLSearchParams(given);
    const before = after.get(site);
    if (before === undefined) own.delete("before");
    else own.set("before", before);
    return { query: own };
  });
  const left = answers.map(({ site, value }) => ({ site, runs: [...(value as AgedRun[])] }));
  const last = new Map(after);
  const found: AgedRun[] = [];
  while (found.length < limit) {
    const heads = left.filter(({ runs }) => runs.length > 0);
    const time = ({ site, runs: [run] }: (typeof left)[number]) => run && momentOf(run, site);
    const next = heads.sort((a, b) => (time(b) ?? 0) - (time(a) ?? 0))[0];
    const run = next?.runs.shift();
    if (next === undefined || run === undefined) break;
    noteSite(run.id, next.site);
    last.set(next.site, run.id);
    found.push(run);
  }
  const end = found.at(-1);
  if (end !== undefined) cursors.set(end.id, last);
  return found;
}

function momentOf({ id, requested_at }: AgedRun, site = siteOfId(id)): number {
  return Date.parse(requested_at) + shiftOf(site);
}

/** Chooses the site of each request. */
export const siteRouter: SiteRouter = {
  ask: askSites,
  siteOfId,
  sitesOfRobot,
  takenElsewhere,
  shiftOf,
  newerFirst: (a, b) => momentOf(b) - momentOf(a),
};
