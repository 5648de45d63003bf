/** Joins the states of the live sockets of all sites: what is not known of one hides nothing of the others. */
import { pageClock, serverTimeOf, tick } from "../clock/server-clock";
import { runnerWords } from "./http";
import type { LiveState, SiteState, StopRequest } from "./live-socket";
import type { Robot } from "./robots";
import type { Joiner, Part } from "./runner-sockets";
import type { Run } from "./runs";
import { setKnowledge, siteOfId, siteRouter } from "./site-requests";
import { type Site, setSiteRouter } from "./sites";

const STEADY = 250; // ms by which the clock of a site may differ from what is shown

export class SitesJoiner implements Joiner {
  #parts: readonly Part[] = [];
  /** The robots of sites that have said them once, by URL: a name stays taken while its site is silent. */
  readonly #robots = new Map<string, ReadonlySet<string>>();
  /** The shift of the clock of each site as it is shown: it changes only where it is off by `STEADY`. */
  readonly #shifts = new WeakMap<Part["socket"], number>();
  /** Runs and robots of a silent site as they are shown, by what the site said last. */
  readonly #doubted = new WeakMap<object, { since: number; shown: Run | Robot }>();

  constructor() {
    setKnowledge((site) => {
      const socket = this.#partOf(site)?.socket;
      return {
        isLive: socket?.state.link === "live",
        robots: this.#robots.get(site.url) ?? null,
        hasRun: (id) => socket?.state.runs.has(id) ?? false,
        shift: socket === undefined ? 0 : this.#steadyShiftOf(socket),
      };
    });
    setSiteRouter(siteRouter);
  }

  join(parts: readonly Part[]): LiveState {
    this.#parts = parts;
    for (const { site, socket } of parts) {
      const { link, engines } = socket.state;
      if (link === "live") this.#robots.set(site.url, new Set(engines.map(({ name }) => name)));
    }
    return this.#joined();
  }

  joinTimes(parts: readonly Part[]): ReturnType<Joiner["joinTimes"]> {
    const joined = (name: "runSeenAt" | "robotAnsweredAt") =>
      new Map(
        parts.flatMap(({ socket }) =>
          [...socket[name]].map(([of, at]) => [of, at + shiftOf(socket)] as const),
        ),
      );
    return { runSeenAt: joined("runSeenAt"), robotAnsweredAt: joined("robotAnsweredAt") };
  }

  partsWith(run: string): readonly Part[] {
    const having = this.#parts.filter(({ socket: { state } }) =>
      [...state.runs.values()].some((each) => each.id === run || each.group === run),
    );
    const known = this.#partOf(siteOfId(run));
    if (having.length > 0) return having;
    return known === undefined ? this.#parts : [known];
  }

  partWith(run: string): Part | undefined {
    return this.#partOf(siteOfId(run));
  }

  /** Returns the displayed clock shift of a site. It changes only by `STEADY` or more, so that messages cause no redraw. */
  #steadyShiftOf(socket: Part["socket"]): number {
    const [before = 0, now] = [this.#shifts.get(socket), shiftOf(socket)];
    if (Math.abs(now - before) < STEADY) return before;
    this.#shifts.set(socket, now);
    return now;
  }

  #partOf(site: Site | undefined): Part | undefined {
    return this.#parts.find((part) => part.site.url === site?.url);
  }

  #joined(): LiveState {
    const sites = this.#parts.map(({ site, socket }) => ({
      site,
      state: socket.state,
      said: (at: number) => new Date(serverTimeOf(at) - shiftOf(socket)).toISOString(),
    }));
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
      runs: this.#runsOf(sites),
      stops: joinedStops(sites),
      asked: sites.flatMap(({ state }) => state.asked),
      queue: joinedQueue(sites),
      sites: sites.map(({ site, state }) => ({ site, state })),
    };
  }

  /**
   * Where several sites have a run, one that is open hides one that has ended; a silent site that is listed no longer
   * hides nothing: it may have moved.
   */
  #runsOf(sites: readonly Doubtful[]): LiveState["runs"] {
    const isOutdated = ({ site, state }: Doubtful) => site.isUnlisted && state.link !== "live";
    const runs = new Map<string, Run>();
    for (const each of sites) {
      for (const [id, run] of each.state.runs) {
        const known = runs.get(id);
        if (known && (isOutdated(each) || known.ended_at === null)) continue;
        runs.set(id, this.#runOf(run, each));
      }
    }
    return runs;
  }

  /** A robot of a silent site does not answer, as far as this page knows. */
  #robotOf(robot: Robot, { site, state, said }: Doubtful): Robot {
    if (state.link === "live" || robot.simulated) return robot;
    return this.#doubt(robot, state.since, () => ({
      ...robot,
      state: "gone",
      since: said(state.since),
      why: `${runnerWords(site.name)} does not answer.`,
    }));
  }

  /** Returns an open run of a silent site as *unknown*: nobody knows what becomes of it. */
  #runOf(run: Run, { state, said }: Doubtful): Run {
    if (state.link === "live" || run.ended_at !== null) return run;
    const since = said(state.since);
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

/** `said`: the time of a tick by the site's clock, as it would say it. */
interface Doubtful extends SiteState {
  readonly said: (at: number) => string;
}

/** Nothing is known of the clock of a site that has not said its time. */
const shiftOf = ({ clock }: Part["socket"]): number =>
  clock.isMeasured ? pageClock.now() - clock.now() : 0;

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
  // A run is at one site: that the others do not have it says nothing of a site that is still asked.
  const may = stops.filter(({ state, isAbsent }) => state !== "refused" || !isAbsent);
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
