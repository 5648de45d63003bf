/** The live sockets of two sites as one: what is unknown at one hides nothing of the other. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Wire, wireOf } from "../testing/wire";
import { runnerAt } from "./client";
import { sessionEnd } from "./http";
import { SitesJoiner } from "./live-sites";
import { openRuns, silentRobots, stateOf, unheardRobots } from "./live-socket";
import { RunnerSockets } from "./runner-sockets";
import { noteSite } from "./site-requests";
import { setSites } from "./sites";

const A = { name: "Hall A", url: "http://h:1" };
const B = { name: "Hall B", url: "http://h:2" };
const robot = (name: string, simulated = false) => ({
  name,
  simulated,
  state: "answering",
  holds: [],
  why: "",
});
const run = (id: string, engine: string, at: number, more: object = {}) => ({
  ...{ id, number: 1, engine, state: "running", ended_at: null, group: null, graph_name: "g" },
  ...{ requested_at: `2026-11-30T10:00:0${at}Z`, unknown_since: null, desired: "running" },
  ...{ actions: {}, alarms: [], ...more },
});
/** The URLs to which Stops were posted. */
let posted: string[];
/** URLs that do not answer. */
let silent: string[];
/** What a URL answers. */
let answers: Map<string, object>;
const NONE = {
  status: 404,
  type: "not_found",
  title: "Not found",
  detail: "There is no such run.",
};
let live: RunnerSockets;

beforeEach(() => {
  vi.useFakeTimers();
  Wire.all = [];
  posted = [];
  silent = [];
  answers = new Map();
  vi.stubGlobal("WebSocket", Wire);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (init.method === "POST") posted.push(url);
    if (silent.some((each) => url.startsWith(each))) throw new TypeError("no answer");
    const found = answers.get(url);
    if (found !== undefined) return Response.json(found, { status: 201 });
    return url.startsWith(`${A.url}/api/runs/new/`)
      ? Response.json(NONE, NONE)
      : Response.json({ runs: [] });
  });
  live = new RunnerSockets();
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  wireOf(A.url).say({
    type: "hello",
    engines: [robot("simulator", true), robot("Carl")],
    runs: [run("a", "Carl", 2)],
  });
  wireOf(B.url).say({
    type: "hello",
    engines: [robot("simulator", true), robot("Dora")],
    runs: [run("b", "Dora", 1)],
  });
});

afterEach(() => {
  live.close();
  setSites([]);
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("robots and runs of both are there, the newest run first, and one simulator", () => {
  expect(live.state.link).toBe("live");
  expect(live.state.engines.map(({ name }) => name)).toEqual(["simulator", "Carl", "Dora"]);
  expect(openRuns(live.state).map(({ id }) => id)).toEqual(["a", "b"]);
});

test("a silent site leaves its runs and robots unknown, and those of the other as they are", () => {
  wireOf(B.url).close(1006);
  const { state } = live;
  expect(state.link).toBe("live");
  expect([...state.runs.values()].map((each) => [each.id, each.state])).toEqual([
    ["a", "running"],
    ["b", "unknown"],
  ]);
  expect(state.runs.get("b")?.unknown_since).not.toBeNull();
  expect(unheardRobots(state).map(({ name, why }) => [name, why])).toEqual([
    ["Dora", "The runner of Hall B does not answer."],
  ]);
  expect([...silentRobots(state)]).toEqual(["Dora"]);
  const before = state.runs.get("b");
  wireOf(A.url).say({ type: "run", run: run("a", "Carl", 2, { state: "paused" }) });
  vi.advanceTimersByTime(200);
  expect(live.state.runs.get("b")).toBe(before); // it is not drawn again
});

test("STOP ALL goes to each, and is heard when each has heard it", async () => {
  silent = [B.url];
  live.stop("all");
  expect(posted).toEqual([`${A.url}/api/stop`, `${B.url}/api/stop`]);
  expect(wireOf(A.url).sent.map((text) => JSON.parse(text).run)).toEqual(["all"]);
  expect(wireOf(B.url).sent.map((text) => JSON.parse(text).run)).toEqual(["all"]);
  await vi.advanceTimersByTimeAsync(500);
  expect(live.state.stops.map(({ state }) => state)).toEqual(["unheard"]);
  const [ofA, ofB] = (live.state.sites ?? []).map(({ state }) => state.stops[0]);
  expect([ofA?.state, ofB?.state]).toEqual(["heard", "unheard"]);
  expect(ofA?.id).toBe(ofB?.id);
  await vi.advanceTimersByTimeAsync(1_100);
  expect(posted.filter((url) => url.startsWith(B.url))).toHaveLength(2); // again, to B alone
  expect(posted.filter((url) => url.startsWith(A.url))).toHaveLength(1);
  silent = [];
  await vi.advanceTimersByTimeAsync(1_100);
  expect(live.state.stops.map(({ state }) => state)).toEqual(["heard"]);
});

test("STOP ALL is proven when both are at rest, and not before", async () => {
  live.stop("all");
  await vi.advanceTimersByTimeAsync(100);
  const ended = { state: "stopped", ended_at: "2026-11-30T10:01:00Z", desired: "stopped" };
  wireOf(A.url).say({ type: "run", run: run("a", "Carl", 2, ended) });
  await vi.advanceTimersByTimeAsync(200);
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  wireOf(B.url).say({ type: "run", run: run("b", "Dora", 1, ended) });
  await vi.advanceTimersByTimeAsync(200);
  expect(live.state.stops[0]?.provenAt).toBeDefined();
});

test("a Stop of a run goes to its site, of an unknown one to all", () => {
  live.stop("b");
  expect(posted).toEqual([`${B.url}/api/runs/b/stop`]);
  posted = [];
  live.stop("nobody-knows");
  expect(posted).toHaveLength(2);
});

/** Starts a run at the second site, whose answer is there before the news over its live socket. */
async function startAtB(): Promise<void> {
  answers.set(`${B.url}/api/runs`, run("new", "Dora", 3, { group: "both" }));
  const body = { engine: "Dora", request_id: "x" } as never;
  live.learn(await runnerAt(A.url).post("/api/runs", { body }));
  posted = [];
}

test("a run that was just started belongs to the site that answered, and its Stop goes there", async () => {
  await startAtB();
  live.stop("new");
  live.stop("both");
  expect(posted).toEqual([`${B.url}/api/runs/new/stop`, `${B.url}/api/runs/both/stop`]);
  const path = { run: "new" };
  await runnerAt(A.url).post("/api/runs/{run}/pause", { path });
  expect(posted.at(-1)).toBe(`${B.url}/api/runs/new/pause`);
});

test("a run that was started while the live socket of its site is down is unknown, and stopped there", async () => {
  wireOf(B.url).close(1006);
  await startAtB();
  expect(live.state.runs.get("new")?.state).toBe("unknown");
  live.stop("new");
  expect(posted).toEqual([`${B.url}/api/runs/new/stop`]);
});

test("a start that is found at a site belongs to it, also if its answer got lost", async () => {
  const found = { under_way: false, queued: null };
  answers.set(`${A.url}/api/starts/x`, { ...found, runs: [] });
  answers.set(`${B.url}/api/starts/x`, { ...found, runs: [run("new", "Dora", 3)] });
  const path = { request_id: "x" };
  const { runs } = await runnerAt(A.url).get("/api/starts/{request_id}", { path });
  for (const each of runs) live.learn(each);
  live.stop("new");
  expect(posted).toEqual([`${B.url}/api/runs/new/stop`]);
});

test("Stop of a run of an unknown site goes to each, and is not refused while one has not answered", async () => {
  live.learn(run("new", "Dora", 3) as never);
  silent = [B.url];
  live.stop("new");
  expect(posted).toEqual([`${A.url}/api/runs/new/stop`, `${B.url}/api/runs/new/stop`]);
  await vi.advanceTimersByTimeAsync(500);
  expect(live.state.stops.map(({ state }) => state)).toEqual(["unheard"]);
  silent = [];
  await vi.advanceTimersByTimeAsync(1_100);
  expect(posted.slice(2)).toEqual([`${B.url}/api/runs/new/stop`]);
  expect(live.state.stops.map(({ state }) => state)).toEqual(["heard"]);
});

test("a Stop of a run of an unknown site that one site may not take is refused, whoever is silent", async () => {
  const problem = { ...NONE, status: 403, type: "forbidden", detail: "Not from here." };
  vi.stubGlobal("fetch", async (url: string) => {
    if (url.startsWith(A.url)) return Response.json(problem, problem);
    throw new TypeError("no answer");
  });
  live.stop("nobody-knows");
  await vi.advanceTimersByTimeAsync(500);
  expect(live.state.stops).toMatchObject([{ state: "refused", detail: "Not from here." }]);
});

test("what one site says wrongly keeps no Stop from the other, and is not known any more", () => {
  const said = vi.spyOn(console, "error").mockImplementation(() => undefined);
  for (const message of [
    { type: "hello", runs: [] },
    { type: "engines" },
    { type: "hello", engines: [robot("Dora"), { name: "Z" }], runs: [] },
    { type: "run", run: { id: "b" } },
  ]) {
    posted = [];
    wireOf(B.url).say(message);
    expect(live.state.sites?.map(({ state }) => state.link)).toEqual(["live", "down"]);
    expect(live.state.runs.get("b")?.state).toBe("unknown");
    live.stop("all");
    expect(posted).toEqual([`${A.url}/api/stop`, `${B.url}/api/stop`]);
    live.redial();
    for (const { url } of [A, B]) wireOf(url).say({ type: "hello", engines: [], runs: [] });
    wireOf(B.url).say({ type: "run", run: run("b", "Dora", 1) });
  }
  expect(said).toHaveBeenCalled();
  live.subscribe(() => {
    throw new Error("not drawn");
  });
  posted = [];
  live.stop("all");
  expect(posted).toHaveLength(2);
  said.mockRestore();
});

test("a run that is known of a site without a live link is shown by the link of its site", () => {
  wireOf(B.url).close(1006);
  noteSite("read", B);
  expect(stateOf(live.state, "read").link).toBe("down");
  expect(stateOf(live.state, "nobody-knows").link).toBe("down"); // it may be there
  expect(stateOf(live.state, "a").link).toBe("live");
});

test("a further site that does not know the session ends it nowhere else", async () => {
  wireOf(B.url).close(4401);
  await vi.advanceTimersByTimeAsync(100);
  expect(sessionEnd.now()).toBe(false);
  wireOf(A.url).close(4401);
  expect(sessionEnd.now()).toBe(true);
  sessionEnd.clear();
});
