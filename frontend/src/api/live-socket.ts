/** The one socket to the runner: live state of runs, and the way for Stop. */
import { pageClock, ServerOffset, tick } from "../clock/server-clock";
import { newAid } from "../graph/stop-basics";
import { runnerOnlyAt } from "./client";
import type { AskedConfirmation } from "./confirmations";
import { errorText, isFinal, isSignedIn, Refusal, sessionEnd } from "./http";
import { isPieceOf } from "./led-runs";
import { checkMessage, isUrgentChange, withKeptParts, withUnseenEnd } from "./live-messages";
import { isBlocked } from "./page-url";
import type { HeldGraph, Robot } from "./robots";
import { postStop } from "./run-stop";
import type { Run } from "./runs";
import type { RunnerApi } from "./schema/runner";
import { isFurtherSite, newerFirst, type Site, siteOfId } from "./sites";
import type { UnreachableReason } from "./unreached";

export type LiveLink = "connecting" | "live" | "down";

/** A Stop that a person asked for. It is done when the run's own state says so, not before. */
export interface StopRequest {
  id: string;
  run: string | "all";
  /** The tick at which it was asked. */
  at: number;
  /**
   * The runs that it is about: those that this page knew to go on when it was asked, those that the runner says it
   * stops, and of "all" those that the runner has stopped since.
   */
  runs: readonly string[];
  /**
   * `asked`: nobody has answered yet; `unheard`: it could not be sent, and is sent again;
   * `heard`: the runner is stopping; `refused`: it will not.
   */
  state: "asked" | "heard" | "refused" | "unheard";
  detail: string;
  /** Set if it is refused since this runner has no such run. */
  isAbsent?: true;
  /** The name of who asked for it, set if it is refused since somebody else signed in before it was heard. */
  disownedPerson?: string;
  /** The tick at which the runner had it. */
  heardAt?: number;
  /**
   * What has to come over the socket before anything is proven: any message, or one about robots where the runner
   * named some that this page does not show as moving or silent.
   */
  awaits?: "message" | "robots";
  /** The tick at which all that it is about was told to rest: that stays proven, whatever is unknown later. */
  provenAt?: number;
}

export interface LiveState {
  link: LiveLink;
  /** The tick at which the link became what it is. */
  since: number;
  /** The reason why the connection is down, as far as known. */
  unreached?: UnreachableReason | null;
  engines: readonly Robot[];
  runs: ReadonlyMap<string, Run>;
  stops: readonly StopRequest[];
  /** Requests of the person's other devices that this page can answer, while the link is live. */
  asked: readonly AskedConfirmation[];
  /** The last message about the queue; nothing waits without one. */
  queue?: RunnerApi["QueueMessage"] | undefined;
  /** The state of each site, where the page has several runners: all else here is joined out of them. */
  sites?: readonly SiteState[];
}

export interface SiteState {
  readonly site: Site;
  readonly state: LiveState;
}

type RunnerMessage = RunnerApi["RunnerMessage"];
type Stopping = RunnerApi["Stopping"];
type PageMessage = RunnerApi["PageMessage"];

const SESSION_ENDED = 4401;
const SILENCE = 3_500; // ms; the runner beats each second
const STOPS_KEPT = 5; // that somebody has answered
const JOINS = 6_000; // ms after "all" is heard in which a run that is being stopped is one of its
const AGAIN = 1_000; // ms between two tries to send a Stop
const SOON = 5_000; // ms; the longest wait for another try to reach the runner
const SELDOM = 60_000; // ms; the same where trying soon has proven to be of no use
const PIECE = /\.\d+$/; // ends the id of a piece of a led run, of which the runner tells as a whole
const TOGETHER = 100; // ms in which news of runs are told together, unless they are urgent

/** Usable without React: `subscribe` and `now` fit `useSyncExternalStore`. */
export class LiveSocket {
  state: LiveState = {
    link: "connecting",
    since: tick(),
    engines: [],
    runs: new Map(),
    stops: [],
    asked: [],
  };
  /**
   * Time at which its engine last showed each open run, by the server's clock. Apart from `now`,
   * since it changes each second.
   */
  runSeenAt: ReadonlyMap<string, number> = new Map();
  /** Time at which each robot last answered, by the server's clock. */
  robotAnsweredAt: ReadonlyMap<string, number> = new Map();
  readonly #seers = new Set<() => void>();
  /** Runs that are being stopped, that the runner does not tell of, and whose end is being asked for. */
  readonly #asking = new Set<string>();
  readonly #runner: string;
  readonly #listeners = new Set<() => void>();
  #socket: WebSocket | null = null;
  #watch: ReturnType<typeof setTimeout> | undefined;
  #again: ReturnType<typeof setTimeout> | undefined;
  #tries = 0;
  #closed = false;
  /** News of runs that listeners are told of soon. */
  #untold: ReturnType<typeof setTimeout> | undefined;
  #toldAt = 0; // tick
  /** Reason why the last socket did not open. */
  #unreached: UnreachableReason | null = null;

  /** The clock of the runner: it may be another one than that of the page. */
  readonly clock: ServerOffset;

  /** `isFirst`: of the runner beside the editor, by whose clock the page goes. */
  constructor(runner: string, isFirst = true) {
    this.#runner = runner;
    this.clock = isFirst ? pageClock : new ServerOffset(pageClock.now());
  }

  open(): void {
    this.#closed = false;
    this.#connect();
  }

  close(): void {
    this.#closed = true;
    clearTimeout(this.#watch);
    clearTimeout(this.#again);
    clearTimeout(this.#untold);
    this.#socket?.close();
    this.#socket = null;
  }

  /** A fresh socket in place of the old one: the runner knows a socket by the session it opened with. */
  redial(): void {
    if (this.#closed) return;
    const old = this.#socket;
    this.#socket = null;
    this.#unreached = null;
    this.#tries = 0;
    old?.close();
    this.#connect();
  }

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  subscribeSeen = (seer: () => void): (() => void) => {
    this.#seers.add(seer);
    return () => this.#seers.delete(seer);
  };

  /**
   * Sends Stop over the socket and by POST at once: whichever arrives first counts. While nobody
   * hears it, it is sent again for as long as the page is open.
   */
  stop(run: string | "all", id: string = newAid(), again = false): void {
    const first = this.#sendStop(run, id, again); // before all else: nothing that fails here keeps it back
    const meant = openRuns(this.state).filter((each) => isMeant(each, run));
    const runs = meant.map((each) => each.id);
    const stop: StopRequest = { id, run, at: tick(), runs, state: "asked", detail: "" };
    void this.#keepStopping(stop, first);
    this.#set({ stops: withStop(this.state.stops, stop) });
  }

  /** "all" is sent as such until it is heard: a run may have begun before it that this page has not seen. */
  async #keepStopping({ id, run }: StopRequest, first: Promise<Stopping>): Promise<void> {
    for (let sent = first; ; sent = this.#sendStop(run, id, true)) {
      await sent.then(
        (answer) => this.#answerStop(id, "heard", "", { answer, awaits: "message" }),
        (error) =>
          this.#answerStop(id, isFinal(error) ? "refused" : "unheard", errorText(error), {
            isAbsent: error instanceof Refusal && error.details.status === 404,
          }),
      );
      const isDue = () =>
        !this.#closed &&
        this.state.stops.some((stop) => stop.id === id && stop.state === "unheard");
      if (!isDue()) return;
      await new Promise((done) => setTimeout(done, AGAIN));
      if (!isDue()) return; // another runner may have this address now
    }
  }

  /** Sends a STOP ALL no more that nobody has answered: it is of somebody who is not signed in any more. */
  disown(person: string): void {
    const stops = this.state.stops.map((stop) => disowned(stop, person));
    this.#set({ stops });
  }

  async #sendStop(run: string, id: string, again: boolean): Promise<Stopping> {
    const posted = postStop(this.#runner, run, id, again); // first: a socket that fails keeps it from nothing
    if (this.#socket?.readyState === WebSocket.OPEN) {
      const message: PageMessage = { type: "stop", run, stop_id: id, again };
      try {
        this.#socket.send(JSON.stringify(message));
      } catch (error) {
        console.warn("A Stop goes by POST alone", error);
      }
    }
    return posted;
  }

  /** Answers for a page that the browser shows; no background tab does. */
  #sayHere(number: number): void {
    if (document.visibilityState !== "visible") return;
    const message: PageMessage = { type: "here", number };
    try {
      this.#socket?.send(JSON.stringify(message));
    } catch (error) {
      console.warn("The runner does not hear that this page is visible", error);
    }
  }

  /** Takes in a run that this page has just started, before the socket tells of it. */
  learn(run: Run): void {
    if (!this.state.runs.has(run.id)) this.#putRun(run);
  }

  /** Takes over what the former address of the runner has said, and sends on each Stop that nobody has answered. */
  takeOver({ runs: theirs, engines, stops }: LiveState): void {
    const isNew = ({ id }: StopRequest) => this.state.stops.every((own) => own.id !== id);
    for (const stop of stops)
      if (isWaiting(stop) && isNew(stop)) this.stop(stop.run, stop.id, true);
    const { link, runs, engines: own } = this.state;
    const others = [...theirs.values()].filter(({ id }) => !runs.has(id));
    const isUnseen = ({ ended_at }: Run) => link === "live" && ended_at === null;
    const told = others.map((run) =>
      isUnseen(run) ? withUnseenEnd(run, this.clock.now() + tick()) : run,
    );
    const unproven = stops.filter((stop) => stop.provenAt === undefined && isNew(stop));
    const joined = this.state.stops.map((stop) =>
      withRuns(stop, stops.find(({ id }) => id === stop.id)?.runs ?? []),
    );
    this.#set({
      engines: link === "live" || own.length > 0 ? own : engines,
      runs: new Map([...told, ...runs.values()].map((run) => [run.id, run])),
      stops: [...unproven, ...joined].sort((a, b) => a.at - b.at),
    });
    for (const run of told) if (isUnseen(run)) void this.#askEnd(run.id);
  }

  #connect(): void {
    clearTimeout(this.#again);
    if (this.#closed) return;
    if (isBlocked(this.#runner)) {
      this.#down();
      void this.#findOut();
      return;
    }
    const socket = new WebSocket(`${this.#runner.replace(/^http/, "ws")}/api/live`);
    let opened = false;
    this.#socket = socket;
    this.#expect(socket);
    socket.onopen = () => {
      opened = true;
    };
    socket.onmessage = (event) => {
      opened = true;
      this.#expect(socket);
      try {
        const message = JSON.parse(String(event.data)) as RunnerMessage;
        this.#hear(message);
        this.#endAwaiting(message.type);
      } catch (error) {
        // What goes on there is not known any more, until a whole account of it comes.
        console.error("A message of the runner cannot be read:", error, event.data);
        this.#unreached = { kind: "mute", why: "What the runner says cannot be read." };
        this.#lost(socket, true);
        socket.close();
      }
    };
    socket.onclose = ({ code }) => {
      const ended = code === SESSION_ENDED;
      const further = isFurtherSite(`${this.#runner}/`);
      // A further site that does not know the session ends it nowhere else.
      if (ended && further) void isSignedIn();
      else if (ended) sessionEnd.notice();
      this.#lost(socket, opened && !(ended && further));
    };
  }

  /** A socket that stays silent is as good as closed, whatever TCP believes. */
  #expect(socket: WebSocket): void {
    clearTimeout(this.#watch);
    this.#watch = setTimeout(() => {
      this.#lost(socket, false);
      socket.close();
    }, SILENCE);
  }

  #lost(socket: WebSocket, opened: boolean): void {
    if (this.#socket !== socket) return;
    this.#socket = null;
    clearTimeout(this.#watch);
    this.#down();
    if (!opened && !this.#closed) void this.#findOut();
  }

  /** There is no link; another try comes after a while, unless nobody is signed in. */
  #down(): void {
    if (this.state.link !== "down") this.#set({ link: "down", since: tick(), asked: [] });
    this.#set({ unreached: this.#unreached });
    clearTimeout(this.#again);
    if (this.#closed || this.#unreached?.kind === "ended") return;
    const longest = this.#unreached?.kind === "strange" ? SELDOM : SOON;
    const wait = Math.min(longest, 250 * 2 ** this.#tries) * (0.7 + 0.6 * Math.random());
    this.#tries += 1;
    this.#again = setTimeout(() => this.#connect(), wait);
  }

  /** A browser does not tell why a socket did not open. */
  async #findOut(): Promise<void> {
    const turn = this.#again;
    const found = await import("./unreached").then(
      ({ findUnreachableReason }) => findUnreachableReason(this.#runner),
      (): UnreachableReason => ({ kind: "silent", why: "The runner does not answer." }),
    );
    if (this.#closed || this.state.link === "live" || turn !== this.#again) return;
    this.#unreached = found;
    this.#set({ unreached: found });
    if (found.kind === "ended") clearTimeout(this.#again);
  }

  #hear(message: RunnerMessage): void {
    checkMessage(message);
    switch (message.type) {
      case "hello": {
        this.#tries = 0;
        this.#unreached = null;
        const runs = new Map(this.state.runs);
        const open = new Set(message.runs.map((run) => run.id));
        // What this page believed to be open and the runner no longer names has ended unseen.
        const unseen = openRuns(this.state)
          .filter(({ id }) => !open.has(id))
          .map((run) => withUnseenEnd(run, this.clock.now() + tick()));
        for (const run of unseen) runs.set(run.id, run);
        for (const run of message.runs) runs.set(run.id, withKeptParts(runs.get(run.id), run));
        this.#joinStops(message.runs);
        this.#set({
          link: "live",
          unreached: null,
          since: tick(),
          engines: message.engines,
          runs,
          queue: undefined, // it is said anew if something waits
        });
        for (const run of unseen) void this.#askEnd(run.id);
        this.#askStopped();
        break;
      }
      case "run":
        this.#putRun(message.run);
        break;
      case "stopping":
        this.#answerStop(message.stop_id, "heard", "", { answer: message });
        break;
      case "refused":
        this.#answerStop(message.stop_id, "refused", message.detail);
        break;
      case "confirm":
        this.#set({ asked: message.asked });
        break;
      case "queue":
        this.#set({ queue: message });
        break;
      case "engines":
        this.#set({ engines: message.engines });
        break;
      case "there":
        this.#sayHere(message.number);
        break;
      case "beat": {
        this.clock.hear(Date.parse(message.at), tick());
        const seen = times(message.seen);
        const heard = times(message.heard);
        if (seen.size + heard.size + this.runSeenAt.size + this.robotAnsweredAt.size === 0) break;
        this.runSeenAt = seen;
        this.robotAnsweredAt = heard;
        tellEach(this.#seers);
        break;
      }
    }
  }

  /** Asks for runs that are being stopped and that the runner does not tell of: they may have ended unseen. */
  #askStopped(): void {
    const { link, stops, runs } = this.state;
    const meant = stops.flatMap((stop) => (link === "live" && isUnproven(stop) ? stop.runs : []));
    for (const id of meant) {
      if (runs.has(id) || this.#asking.has(id)) continue;
      this.#asking.add(id);
      void this.#askEnd(id).finally(() => this.#asking.delete(id));
    }
  }

  /** Asks how a run has ended until it is known, or the runner says something newer of the run. */
  async #askEnd(id: string): Promise<void> {
    const run = this.state.runs.get(id);
    const isAsked = () => !this.#closed && this.state.runs.get(id) === run;
    while (isAsked()) {
      try {
        const path = { run: id };
        const ended = await runnerOnlyAt(this.#runner).get("/api/runs/{run}", { path });
        if (isAsked()) this.#putRun(ended);
        return;
      } catch (error) {
        console.warn("A run's end is not known", id, errorText(error));
        if (isFinal(error)) {
          const others = [...this.state.runs].filter(([other]) => other !== id);
          if (isAsked()) this.#set({ runs: new Map(others) });
          return;
        }
      }
      await new Promise((done) => setTimeout(done, SOON));
    }
  }

  /** An action that ends tells of itself and of the next one: they are drawn together. */
  #putRun(run: Run): void {
    const before = this.state.runs.get(run.id);
    const now = withKeptParts(before, run);
    if (now === before) return; // the runner tells of each change of what it knows, also of the unseen
    this.#joinStops([run]);
    this.state = { ...this.state, runs: new Map(this.state.runs).set(run.id, now) };
    const wait = this.#toldAt + TOGETHER - tick();
    if (wait <= 0 || isUrgentChange(before, now)) this.#tell();
    else this.#untold ??= setTimeout(() => this.#tell(), wait);
  }

  /** `more`: what its answer says beyond that, and what has to come after it. */
  #answerStop(
    id: string,
    state: StopRequest["state"],
    detail: string,
    more: { answer?: Stopping; awaits?: "message"; isAbsent?: boolean } = {},
  ): void {
    const { answer, isAbsent } = more;
    const heard = state === "heard" && { heardAt: tick() };
    const awaits = answer && namesMore(answer, this.state) ? ("robots" as const) : more.awaits;
    const named = answer?.runs.map((run) => run.replace(PIECE, "")) ?? [];
    const stops = this.state.stops.map((stop) => {
      if (stop.id !== id || stop.state === "heard" || (stop.disownedPerson && !heard)) return stop;
      // What began until it was heard is stopped by it as well.
      const isLate = heard && stop.run === "all" && tick() - stop.at > AGAIN;
      const lateRuns = isLate ? openRuns(this.state).map((run) => run.id) : [];
      const runs = [...new Set([...stop.runs, ...lateRuns, ...named])];
      const said = { ...(awaits && { awaits }), ...(isAbsent && { isAbsent }) };
      return { ...stop, state, detail, ...heard, ...said, runs };
    });
    this.#set({ stops });
    this.#askStopped();
  }

  /** Takes note that a message has come, after all that it says is known. */
  #endAwaiting(type: RunnerMessage["type"]): void {
    const isOfRobots = type === "hello" || type === "engines";
    const isOver = ({ awaits }: StopRequest) =>
      awaits === "message" || (awaits === "robots" && isOfRobots);
    if (!this.state.stops.some(isOver)) return;
    const stops = this.state.stops.map((stop) => {
      const { awaits: _, ...rest } = stop;
      return isOver(stop) ? rest : stop;
    });
    this.#set({ stops });
  }

  /** Add runs that the runner stops and that this page did not know when it asked to stop all. */
  #joinStops(told: readonly Run[]): void {
    const stopping = told.filter((run) => run.ended_at === null && run.desired === "stopped");
    if (stopping.length === 0) return;
    const stops = this.state.stops.map((stop) => {
      const { heardAt } = stop;
      if (stop.run !== "all" || heardAt === undefined) return stop;
      // While it awaits a message, this is the first that is seen since.
      if (stop.awaits === undefined && tick() - heardAt > JOINS) return stop;
      return withRuns(
        stop,
        stopping.map(({ id }) => id),
      );
    });
    this.state = { ...this.state, stops };
  }

  #set(part: Partial<LiveState>): void {
    this.state = { ...this.state, ...part };
    this.#tell();
  }

  /** Note proven Stops at once: later the runner may be silent, and other runs may begin. */
  #noteProven(): void {
    const isNew = (stop: StopRequest) => stop.provenAt === undefined && isProven(stop, this.state);
    if (!this.state.stops.some(isNew)) return;
    const stops = this.state.stops.map((stop) =>
      isNew(stop) ? { ...stop, provenAt: tick() } : stop,
    );
    this.state = { ...this.state, stops };
  }

  #tell(): void {
    this.#noteProven();
    clearTimeout(this.#untold);
    this.#untold = undefined;
    this.#toldAt = tick();
    tellEach(this.#listeners);
  }
}

/** Return a Stop that is about these runs, too: one of which it was not is not proven yet. */
function withRuns(stop: StopRequest, runs: readonly string[]): StopRequest {
  const more = runs.filter((id) => !stop.runs.includes(id));
  const { provenAt: _, ...rest } = stop;
  return more.length === 0 ? stop : { ...rest, runs: [...stop.runs, ...more] };
}

/**
 * Return the Stops with a new one. Those of the same target that nobody has answered are one, and so are those that
 * are not proven: each is about all that they were about. Of all others the newest are kept.
 */
function withStop(stops: readonly StopRequest[], stop: StopRequest): StopRequest[] {
  const isOver = (each: StopRequest) => !isWaiting(each) && !isUnproven(each);
  const dropped = new Set(stops.filter(isOver).slice(0, 1 - STOPS_KEPT));
  const kept = new Map<string, StopRequest>();
  for (const each of [...stops, stop].filter((one) => !dropped.has(one))) {
    const key = isOver(each) ? each.id : `${isWaiting(each)} ${each.run}`;
    const before = kept.get(key);
    kept.delete(key); // the joined one stands where the last one stood
    kept.set(key, before ? { ...each, runs: [...new Set([...before.runs, ...each.runs])] } : each);
  }
  return [...kept.values()];
}

/** Return whether nobody has answered a Stop. */
export const isWaiting = ({ state }: StopRequest): boolean =>
  state === "asked" || state === "unheard";

/** Return whether the runner has a Stop, and has not shown that all that it is about rests. */
export const isUnproven = ({ state, provenAt }: StopRequest): boolean =>
  state === "heard" && provenAt === undefined;

/** Return whether an answer names robots of which this page does not show why they may move. */
function namesMore({ graphs, unknown }: Stopping, now: LiveState): boolean {
  const moving = new Set(foreignGraphs(now).map(({ robot }) => robot.name));
  const silent = new Set(unheardRobots(now).map(({ name }) => name));
  return (
    Object.keys(graphs ?? {}).some((name) => !moving.has(name)) ||
    Object.keys(unknown ?? {}).some((name) => !silent.has(name))
  );
}

/** Return a STOP ALL that nobody has answered as one that is not sent any more: its person is not signed in. */
export function disowned(stop: StopRequest, person: string): StopRequest {
  if (stop.run !== "all" || !isWaiting(stop)) return stop;
  return { ...stop, state: "refused", disownedPerson: person };
}

/** Calls all listeners. One that fails keeps no other one, and nothing that comes after, from its turn. */
export function tellEach(listeners: Iterable<() => void>): void {
  for (const listener of listeners) {
    try {
      listener();
    } catch (error) {
      console.error("News of a runner are not shown:", error);
    }
  }
}

/** Moments of the server's clock by name, ms since 1970. */
function times(told: Record<string, string> | undefined): Map<string, number> {
  return new Map(Object.entries(told ?? {}).map(([name, at]) => [name, Date.parse(at)]));
}

/** The runs that go on, newest first, as far as this page knows. */
export function openRuns(now: LiveState): Run[] {
  return [...now.runs.values()].filter((run) => run.ended_at === null).sort(newerFirst);
}

/**
 * Return the site that has a run; one of those of which nothing is known now, if there is one, while it is not
 * known which has it.
 */
export function siteWith(now: LiveState, run: string): SiteState | undefined {
  const known = siteOfId(run);
  return (
    now.sites?.find(({ site, state }) => state.runs.has(run) || site === known) ??
    silentSites(now)[0]
  );
}

/** Return the state of the site that has a run; `now` with one runner. */
export function stateOf(now: LiveState, run: string | undefined): LiveState {
  return (run === undefined ? undefined : siteWith(now, run)?.state) ?? now;
}

/** Return the sites of which nothing is known now. */
export function silentSites(now: LiveState): SiteState[] {
  return (now.sites ?? []).filter(({ state }) => state.link !== "live");
}

/** The newest run of a graph that this page has heard of live. */
export function newestRun(now: LiveState, graph: string): Run | null {
  let newest: Run | null = null;
  for (const run of now.runs.values()) {
    if (run.graph === graph && (newest === null || newerFirst(run, newest) < 0)) newest = run;
  }
  return newest;
}

/**
 * Return the graphs that robots run and that were not started from here. Sub-graphs are left out.
 */
export function foreignGraphs(now: LiveState): { robot: Robot; held: HeldGraph }[] {
  return now.engines.flatMap((robot) => {
    const moving = robot.holds.filter((held) => held.active);
    const tops = moving.filter((held) => !moving.some((top) => isPart(held.graph, top.graph)));
    return tops.filter((held) => !isOurs(now, robot, held)).map((held) => ({ robot, held }));
  });
}

function isPart(graph: string, top: string): boolean {
  return graph !== top && graph.startsWith(`${top}__`);
}

function isOurs(now: LiveState, robot: Robot, held: HeldGraph): boolean {
  return openRuns(now).some(
    (run) =>
      isPieceOf(run, robot.name, held.graph) ||
      held.run?.startsWith(`${run.id}.`) ||
      (run.engine === robot.name && (run.id === held.run || isPart(held.graph, run.graph_name))),
  );
}

/** Robots that do not answer now: what they run is not known. */
export function unheardRobots(now: LiveState): Robot[] {
  return now.engines.filter(
    ({ simulated, state }) => !simulated && state !== "answering" && state !== "restarted",
  );
}

/** Return the names of all robots of which nothing is known now. */
export function silentRobots(now: LiveState): ReadonlySet<string> {
  const silent = now.link === "live" ? unheardRobots(now) : now.engines;
  return new Set(silent.map(({ name }) => name));
}

/** Return whether a Stop of `what`, a run, a group or all, means a run. */
function isMeant(run: Run, what: StopRequest["run"]): boolean {
  return what === "all" || run.id === what || run.group === what;
}

/** The runs that a Stop is about, as far as this page knows them. */
export function stopTargets(stop: StopRequest, now: LiveState): Run[] {
  const all = stop.run === "all";
  return [...now.runs.values()].filter((run) =>
    all ? stop.runs.includes(run.id) : isMeant(run, stop.run),
  );
}

/** Return whether the runner says now that everything that a Stop is about has come to rest. */
function isProven(stop: StopRequest, now: LiveState): boolean {
  if (now.link !== "live" || stop.state !== "heard" || stop.awaits !== undefined) return false;
  const runs = stopTargets(stop, now);
  if (!stop.runs.every((id) => now.runs.has(id))) return false;
  if (runs.some((run) => run.ended_at === null || run.state === "lost")) return false;
  if (stop.run !== "all") return runs.length > 0;
  return foreignGraphs(now).length === 0 && unheardRobots(now).length === 0;
}
