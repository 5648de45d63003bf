/** The live sockets of all sites behind one: what is not known of one site hides nothing of the others. */
import { serverTimeOf, tick } from "../clock/server-clock";
import { newAid } from "../graph/stop-basics";
import { runnerWords } from "./http";
import {
  LiveSocket,
  type LiveState,
  type SiteState,
  type StopRequest,
  tellEach,
} from "./live-socket";
import type { Robot } from "./robots";
import type { Run } from "./runs";
import { setSites, siteOfId } from "./site-knowledge";
import { siteRouter } from "./site-requests";
import { type Site, setSiteRouter } from "./sites";

/** The part of a `LiveSocket` that others use. */
export type Live = Pick<LiveSocket, keyof LiveSocket>;

interface Part {
  readonly site: Site;
  readonly socket: LiveSocket;
}

export class LiveSites implements Live {
  state: LiveState;
  runSeenAt: ReadonlyMap<string, number> = new Map();
  robotAnsweredAt: ReadonlyMap<string, number> = new Map();
  readonly #parts: readonly Part[];
  readonly #listeners = new Set<() => void>();
  readonly #seers = new Set<() => void>();
  /** The robots of sites that have said them once: a name stays taken while its site is silent. */
  readonly #robots = new Map<Site, ReadonlySet<string>>();
  /** Runs and robots of a silent site as they are shown, by what the site said last. */
  readonly #doubted = new WeakMap<object, { since: number; shown: Run | Robot }>();

  constructor(sites: readonly Site[]) {
    this.#parts = sites.map((site) => ({ site, socket: new LiveSocket(site.url) }));
    this.state = this.#joined();
    for (const { socket } of this.#parts) {
      socket.subscribe(() => this.#hear());
      socket.subscribeSeen(() => this.#see());
    }
    setSites(sites, (site) => ({
      isLive: this.#partOf(site)?.socket.state.link === "live",
      robots: this.#robots.get(site) ?? null,
      hasRun: (id) => this.#partOf(site)?.socket.state.runs.has(id) ?? false,
    }));
    setSiteRouter(siteRouter(sites));
  }

  open(): void {
    for (const { socket } of this.#parts) socket.open();
  }

  close(): void {
    for (const { socket } of this.#parts) socket.close();
  }

  redial(): void {
    for (const { socket } of this.#parts) socket.redial();
  }

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  subscribeSeen = (seer: () => void): (() => void) => {
    this.#seers.add(seer);
    return () => this.#seers.delete(seer);
  };

  /** Sends Stop of a run or group to its site, to all while it is not known which one has it. */
  stop(run: string | "all", id: string = newAid()): void {
    tellEach(
      this.#having(run).map(
        ({ socket }) =>
          () =>
            socket.stop(run, id),
      ),
    );
  }

  #having(run: string | "all"): readonly Part[] {
    if (run === "all") return this.#parts;
    const having = this.#parts.filter(({ socket: { state } }) =>
      [...state.runs.values()].some((each) => each.id === run || each.group === run),
    );
    const known = this.#partOf(siteOfId(run));
    if (having.length > 0) return having;
    return known === undefined ? this.#parts : [known];
  }

  learn(run: Run): void {
    this.#partOf(siteOfId(run.id))?.socket.learn(run); // of an unknown site it stays unknown to all
  }

  #partOf(site: Site | undefined): Part | undefined {
    return this.#parts.find((part) => part.site === site);
  }

  #hear(): void {
    for (const { site, socket } of this.#parts) {
      const { link, engines } = socket.state;
      if (link === "live") this.#robots.set(site, new Set(engines.map(({ name }) => name)));
    }
    this.state = this.#joined();
    tellEach(this.#listeners);
  }

  #see(): void {
    const sockets = this.#parts.map(({ socket }) => socket);
    this.runSeenAt = new Map(sockets.flatMap((each) => [...each.runSeenAt]));
    this.robotAnsweredAt = new Map(sockets.flatMap((each) => [...each.robotAnsweredAt]));
    tellEach(this.#seers);
  }

  #joined(): LiveState {
    const sites = this.#parts.map(({ site, socket: { state } }) => ({ site, state }));
    const links = sites.map(({ state }) => state.link);
    const link = links.find((each) => each === "live") ?? links.find((each) => each !== "down");
    const chosen = sites.find(({ state }) => state.link === (link ?? "down"))?.state;
    return {
      link: link ?? "down",
      since: chosen?.since ?? tick(),
      unreached: chosen?.unreached ?? null,
      engines: sites.flatMap((each, i) =>
        each.state.engines
          .filter(({ simulated }) => i === 0 || !simulated)
          .map((robot) => this.#robotOf(robot, each)),
      ),
      runs: new Map(
        sites.flatMap((each) =>
          [...each.state.runs].map(([id, run]) => [id, this.#runOf(run, each)]),
        ),
      ),
      stops: joinedStops(sites),
      asked: sites.flatMap(({ state }) => state.asked),
      queue: joinedQueue(sites),
      sites,
    };
  }

  /** A robot of a silent site does not answer, as far as this page knows. */
  #robotOf(robot: Robot, { site, state }: SiteState): Robot {
    if (state.link === "live" || robot.simulated) return robot;
    return this.#doubt(robot, state.since, () => ({
      ...robot,
      state: "gone",
      since: new Date(serverTimeOf(state.since)).toISOString(),
      why: `${runnerWords(site.name)} does not answer.`,
    }));
  }

  /** Returns an open run of a silent site as *unknown*: nobody knows what becomes of it. */
  #runOf(run: Run, { state }: SiteState): Run {
    if (state.link === "live" || run.ended_at !== null) return run;
    const since = new Date(serverTimeOf(state.since)).toISOString();
    return this.#doubt(run, state.since, () => ({
      ...run,
      state: "unknown",
      unknown_since: run.unknown_since ?? since,
    }));
  }

  /** Returns the same object again while nothing has changed, so that it is not drawn again. */
  #doubt<T extends Run | Robot>(said: T, since: number, made: () => T): T {
    const known = this.#doubted.get(said);
    if (known?.since === since) return known.shown as T;
    const shown = made();
    this.#doubted.set(said, { since, shown });
    return shown;
  }
}

/** A Stop that several sites have got is one: it is as far as the site that is least far. */
function joinedStops(sites: readonly SiteState[]): StopRequest[] {
  const parts = new Map<string, { name: string; stop: StopRequest }[]>();
  for (const { site, state } of sites) {
    for (const stop of state.stops) {
      parts.set(stop.id, [...(parts.get(stop.id) ?? []), { name: site.name, stop }]);
    }
  }
  return [...parts.values()].map(joinedStop).sort((a, b) => a.at - b.at);
}

const FARNESS = ["refused", "unheard", "asked", "heard"] as const;

function joinedStop(parts: readonly { name: string; stop: StopRequest }[]): StopRequest {
  const stops = parts.map(({ stop }) => stop);
  // A run is at one site: the others refuse a Stop of it, which says nothing of a site that is still asked.
  const may = stops.filter(({ state }) => stops[0]?.run === "all" || state !== "refused");
  const has = may.filter(({ state }) => stops[0]?.run !== "all" && state === "heard");
  const counted = [has, may].find((each) => each.length > 0) ?? stops;
  const worst = FARNESS.flatMap((state) => counted.filter((stop) => stop.state === state))[0];
  if (worst === undefined) throw new Error("A Stop of no site.");
  const proven = counted.map(({ provenAt }) => provenAt ?? Number.NaN);
  const { provenAt: _, ...rest } = worst;
  const provenAt = Math.max(...proven);
  return {
    ...rest,
    runs: [...new Set(counted.flatMap(({ runs }) => runs))],
    ...(Number.isNaN(provenAt) ? {} : { provenAt }),
  };
}

function joinedQueue(sites: readonly SiteState[]): LiveState["queue"] {
  const said = sites.flatMap(({ state: { queue } }) => (queue === undefined ? [] : [queue]));
  const [first, ...others] = said;
  if (first === undefined || others.length === 0) return first;
  const ready = said.flatMap(({ ready_at: at }) => (at === null ? [] : [at])).sort();
  return {
    ...first,
    number: said.reduce((sum, { number }) => sum + number, 0),
    yours: said.reduce((sum, { yours }) => sum + yours, 0),
    ready_at: ready[0] ?? null,
  };
}
