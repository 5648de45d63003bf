/** The sockets of all runners behind one, also without what joins them, and while runners come and go. */

import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { serverNow } from "../clock/server-clock";
import { wholeNotice } from "../runs/stop/stop-notice";
import { progressByAid } from "../status/progress";
import { plain } from "../testing/texts";
import { Wire, wireOf, wiresOf } from "../testing/wire";
import { runnerAt } from "./client";
import { SitesJoiner } from "./live-sites";
import { foreignGraphs, type LiveState, openRuns, silentSites } from "./live-socket";
import { RunnerSockets } from "./runner-sockets";
import type { Run } from "./runs";
import { shiftOfRun } from "./site-places";
import { noteSite, siteOfId } from "./site-requests";
import { allSites, setSites } from "./sites";

const A = { name: "Hall A", url: "http://h:1" };
const B = { name: "Hall B", url: "http://h:2" };
const C = { name: "Hall C", url: "http://h:3" };
const run = (id: string, more: object = {}) => ({
  ...{ id, number: 1, engine: "Dora", state: "running", ended_at: null, group: null },
  ...{ requested_at: "2026-11-30T10:00:00Z", unknown_since: null, desired: "running" },
  ...{ graph_name: "g", actions: {}, alarms: [], ...more },
});
const DORA = { name: "Dora", simulated: false, state: "answering", holds: [] };
const hello = (url: string, ...runs: object[]) =>
  wireOf(url).say({ type: "hello", engines: [], runs });
const said = (now: LiveState) => plain(wholeNotice(now, new Set(), performance.now())?.text);

/** The URLs to which Stops were posted, and the ids of these Stops. */
let posted: { url: string; id: string }[];
let silent: string[];
let live: RunnerSockets;
const stopped = () => posted.map(({ url }) => url.slice(0, 10)).sort();

beforeEach(() => {
  vi.useFakeTimers();
  Wire.all = [];
  posted = [];
  silent = [];
  vi.stubGlobal("WebSocket", Wire);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (init.method === "POST") posted.push({ url, id: JSON.parse(String(init.body)).stop_id });
    if (silent.some((each) => url.startsWith(each))) throw new TypeError("no answer");
    return Response.json({ runs: [] });
  });
  live = new RunnerSockets();
});

afterEach(() => {
  live.close();
  setSites([]);
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("STOP ALL reaches each site, and is proven there, though what joins them does not load", async () => {
  live.setSites([A, B]);
  live.setLost("A part of this page did not load.");
  hello(A.url, run("a"));
  hello(B.url, run("b", { number: 2 }));
  expect(live.state.link).toBe("down"); // what runs is shown by nothing of this page
  expect(live.state.unreached?.why).toContain("did not load");
  silent = [B.url];
  live.stop("all");
  await vi.advanceTimersByTimeAsync(1_100);
  expect(stopped()).toEqual([A.url, B.url, B.url]);
  expect(JSON.parse(wireOf(B.url).sent[0] ?? "").run).toBe("all");
  const rest = { state: "stopped", ended_at: "2026-11-30T10:01:00Z", desired: "stopped" };
  wireOf(A.url).say({ type: "run", run: run("a", rest) });
  await vi.advanceTimersByTimeAsync(200);
  expect(said(live.state)).toMatch(/NOT SENT at Hall B.* Hall A: Run 1: stopped\./);
});

test("a Stop of the time in which nothing was joined is one with what comes later", async () => {
  live.setSites([A, B]);
  hello(A.url, run("a"));
  hello(B.url, run("b"));
  live.stop("all");
  live.setJoiner(new SitesJoiner());
  expect(live.state.link).toBe("live");
  expect(openRuns(live.state)).toHaveLength(2);
  expect(live.state.stops).toHaveLength(1);
});

test("a Stop before any runner is known is kept and said not to be sent, and goes to each", async () => {
  const asked = vi.fn();
  live = new RunnerSockets(asked);
  live.stop("all");
  expect(asked).toHaveBeenCalledOnce();
  expect(live.state.stops.map(({ run, state }) => [run, state])).toEqual([["all", "asked"]]);
  await vi.advanceTimersByTimeAsync(600_000); // the editor does not answer
  live.setSites([A, B]);
  expect(stopped()).toEqual([A.url, B.url]);
  expect(new Set(posted.map(({ id }) => id))).toEqual(new Set([live.state.stops[0]?.id]));
});

test("a site that comes while the page is open is shown, and has what STOP ALL was about", async () => {
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  for (const { url } of [A, B]) hello(url);
  live.stop("all");
  live.setSites([A, B, C]);
  expect(wiresOf(A.url)).toHaveLength(1); // nobody is dialled anew
  expect(stopped()).toEqual([A.url, B.url, C.url]);
  expect(new Set(posted.map(({ id }) => id)).size).toBe(1);
  expect(silentSites(live.state).map(({ site }) => site.name)).toEqual(["Hall C"]);
  hello(C.url, run("c"));
  expect(openRuns(live.state).map(({ id }) => id)).toEqual(["c"]);
  expect(siteOfId("c")?.name).toBe("Hall C");
  posted = [];
  live.stop("all");
  expect(stopped()).toEqual([A.url, B.url, C.url]);
});

test("a site that comes long after a Stop keeps what its people started", async () => {
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  live.stop("all");
  await vi.advanceTimersByTimeAsync(61_000);
  posted = [];
  live.setSites([A, B, C]);
  expect(posted.filter(({ url }) => url.startsWith(C.url))).toEqual([]);
});

test("a site that comes after the device has slept keeps what its people started", () => {
  live.setSites([A, B]);
  live.stop("all");
  vi.setSystemTime(Date.now() + 9 * 3_600_000); // the clock of the page stood still meanwhile
  posted = [];
  live.setSites([A, B, C]);
  expect(posted).toEqual([]);
});

test("a second site makes of one runner two, and its socket stays", () => {
  live.setSites([{ name: "", url: A.url }]);
  hello(A.url, run("a"));
  expect(live.state.sites).toBeUndefined();
  expect(allSites()).toEqual([]);
  live.setSites([A, B]);
  live.stop("all");
  expect(stopped()).toEqual([A.url, B.url]); // also before they are joined
  live.setJoiner(new SitesJoiner());
  expect(live.state.sites?.map(({ site }) => site.name)).toEqual(["Hall A", "Hall B"]);
  expect(openRuns(live.state).map(({ id }) => id)).toEqual(["a"]);
  expect(wiresOf(A.url)).toHaveLength(1);
});

test("a site that has moved gets the Stops that nobody has answered, and no other", async () => {
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  for (const { url } of [A, B]) hello(url);
  hello(B.url, run("b"));
  wireOf(B.url).close(1006);
  silent = [B.url];
  live.stop("b");
  await vi.advanceTimersByTimeAsync(100);
  const [first] = posted;
  posted = [];
  live.setSites([A, { ...B, url: C.url }]);
  expect(posted).toEqual([{ url: `${C.url}/api/runs/b/stop`, id: first?.id }]);
  hello(C.url, run("b"));
  live.setSites([A, { ...B, url: C.url }]); // as the page hears again and again
  await vi.advanceTimersByTimeAsync(1_100);
  posted = [];
  await vi.advanceTimersByTimeAsync(5_000);
  expect(posted).toEqual([]); // the former place is asked no more
  expect(live.state.sites?.map(({ site }) => site.url)).toEqual([A.url, C.url]);
});

test("a site that is named no longer stays while something goes on there, and goes when it rests", () => {
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  hello(A.url);
  hello(B.url, run("b"));
  const names = () => live.state.sites?.map(({ site }) => site.name);
  for (let look = 0; look < 2; look += 1) {
    live.setSites([A]);
    expect(names()).toEqual(["Hall A", "Hall B (no longer listed)"]);
  }
  live.stop("all");
  expect(stopped()).toEqual([A.url, B.url]);
  wireOf(B.url).say({ type: "run", run: run("b", { ended_at: "2026-11-30T10:01:00Z" }) });
  live.setSites([A]);
  expect(names()).toEqual(["Hall A", "Hall B (no longer listed)"]); // the Stop has no answer yet
});

test("a site that has moved is stopped at its former address until the new one says what goes on", async () => {
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  hello(A.url);
  hello(B.url, run("b"));
  silent = [C.url];
  live.setSites([A, { ...B, url: C.url }]);
  live.stop("all");
  expect(stopped()).toEqual([A.url, B.url, C.url]);
  wireOf(B.url).close(1006);
  live.setSites([A, { ...B, url: C.url }]);
  posted = [];
  live.stop("all");
  expect(stopped()).toEqual([A.url, B.url, C.url]);
});

test("a runner that has moved gets its Stops, and none goes for it to the one that has its address now", async () => {
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  hello(A.url);
  hello(B.url, run("b"));
  wireOf(B.url).close(1006);
  silent = [B.url];
  live.stop("all");
  await vi.advanceTimersByTimeAsync(70_000);
  const [first] = posted;
  noteSite("read", B);
  silent = [];
  posted = [];
  const [moved, newcomer] = [
    { ...B, url: C.url },
    { name: "Hall C", url: B.url },
  ];
  live.setSites([A, moved, newcomer]);
  await vi.advanceTimersByTimeAsync(5_000);
  expect(posted).toEqual([{ url: `${C.url}/api/stop`, id: first?.id }]);
  expect(live.state.sites?.map(({ site }) => site)).toEqual([A, moved, newcomer]);
  expect(openRuns(live.state).map(({ id, state }) => [id, state])).toEqual([["b", "unknown"]]);
  hello(B.url, run("c"));
  for (const each of ["b", "read"]) {
    live.stop(each);
    expect(posted.at(-1)?.url).toBe(`${C.url}/api/runs/${each}/stop`);
  }
});

test("a Stop that a runner has heard is proven at the address to which it moves", async () => {
  const stopped = { state: "stopped", ended_at: "2026-11-30T10:01:00Z", desired: "stopped" };
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  hello(A.url);
  hello(B.url, run("b"));
  live.stop("all");
  await vi.advanceTimersByTimeAsync(70_000);
  const sites = [A, { ...B, url: C.url }];
  posted = [];
  live.setSites(sites);
  hello(C.url, run("b", { desired: "stopped" }));
  hello(A.url);
  expect(live.state.runs.get("b")?.state).toBe("running"); // as its runner says, and not as nobody did
  live.setSites(sites);
  expect(live.state.sites?.map(({ site }) => site)).toEqual(sites);
  expect(live.state.stops).toMatchObject([{ state: "heard", runs: ["b"] }]);
  expect(live.isStopping).toBe(true);
  expect(posted).toEqual([]); // it may have begun something since that nobody meant to stop
  wireOf(C.url).say({ type: "run", run: run("b", stopped) });
  await vi.advanceTimersByTimeAsync(200);
  expect(live.isStopping).toBe(false);
  expect(said(live.state)).toContain("Hall B: Run 1: stopped.");
});

test("a run that is open at one site stays open, although another site reports its end", async () => {
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  hello(A.url, run("r"));
  hello(B.url);
  wireOf(B.url).say({ type: "run", run: run("r", { ended_at: "2026-11-30T10:01:00Z" }) });
  await vi.advanceTimersByTimeAsync(200);
  expect(openRuns(live.state).map(({ id }) => id)).toEqual(["r"]);
  hello(A.url);
  wireOf(A.url).say({ type: "run", run: run("r", { ended_at: "2026-11-30T10:01:00Z" }) });
  hello(B.url, run("r"));
  expect(openRuns(live.state).map(({ id }) => id)).toEqual(["r"]);
});

test("one runner that moves is stopped at both addresses, also where nothing joins them", () => {
  live.setSites([{ name: "", url: A.url }]);
  hello(A.url, run("a"));
  live.setSites([{ name: "", url: C.url }]);
  live.stop("all");
  expect(stopped()).toEqual([A.url, C.url]);
});

test("a Stop that is not proven stays in sight when its runner moves, or is named no longer", async () => {
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  hello(A.url);
  hello(B.url, run("b"));
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10);
  wireOf(B.url).close(1006);
  live.setSites([A, { ...B, url: C.url }]);
  hello(C.url);
  live.setSites([A, { ...B, url: C.url }]);
  await vi.advanceTimersByTimeAsync(3_000);
  expect(said(live.state)).toContain("UNCONFIRMED");
});

test("a Stop is going on while any one is not answered, or not proven", async () => {
  live.setSites([A]);
  hello(A.url, run("a"), run("b"));
  const beat = async () => {
    await vi.advanceTimersByTimeAsync(1_100);
    wireOf(A.url).say({ type: "beat", at: "" });
  };
  const end = (id: string, state: string) =>
    wireOf(A.url).say({ type: "run", run: run(id, { state, ended_at: "2026-11-30T10:01:00Z" }) });
  expect(live.isStopping).toBe(false);
  silent = [A.url];
  live.stop("a");
  expect(live.isStopping).toBe(true);
  silent = [];
  await beat();
  expect(live.state.stops).toMatchObject([{ run: "a", state: "heard" }]);
  expect(live.isStopping).toBe(true);
  live.stop("all");
  end("a", "lost");
  end("b", "stopped");
  for (let n = 0; n < 6; n += 1) {
    await beat();
    live.stop("all"); // nothing runs any more
  }
  await beat();
  expect(live.isStopping).toBe(true); // nobody has looked at what was lost
  end("a", "stopped");
  expect(live.isStopping).toBe(false);
});

test("of several runners that became one, Stop of a run goes to that one", () => {
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  for (const { url } of [A, B]) hello(url);
  live.setSites([{ name: "", url: C.url }]);
  hello(C.url, run("c"));
  live.stop("c");
  expect(posted.map(({ url }) => url)).toEqual([`${C.url}/api/runs/c/stop`]);
});

test("nothing is started at a runner that is named no longer", async () => {
  live.setJoiner(new SitesJoiner());
  live.setSites([A, B]);
  hello(A.url);
  wireOf(B.url).say({ type: "hello", engines: [DORA], runs: [run("b")] });
  live.setSites([A, { ...B, url: C.url }]);
  const start = { body: { engine: "Dora", request_id: "q" } as never };
  await expect(runnerAt(A.url).post("/api/runs", start)).rejects.toThrow(
    "nothing is started there",
  );
  expect(posted).toEqual([]);
});

test("a site that is named no longer and rests is gone, and one runner needs no name", async () => {
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  for (const { url } of [A, B]) hello(url);
  live.stop("all");
  await vi.advanceTimersByTimeAsync(100);
  wireOf(B.url).say({ type: "beat", at: "" }); // it has said since that nothing runs
  live.setSites([{ name: "", url: A.url }]);
  expect(live.state.sites).toBeUndefined();
  expect(wireOf(B.url).readyState).not.toBe(WebSocket.OPEN);
  posted = [];
  live.stop("all");
  expect(stopped()).toEqual([A.url]);
});

test("a site that sends incomplete messages hides neither STOP nor a notice of other sites", async () => {
  const failed = vi.spyOn(console, "error").mockImplementation(() => undefined);
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  const robot = (more: object) => ({ engines: [{ ...DORA, name: "Eve", ...more }], runs: [] });
  const open = (more: object) => ({ engines: [], runs: [run("b", { number: 2, ...more })] });
  const held = { graph: "g", active: true, run: null, stopping: null };
  const odd = [
    ...[[null], [{}], [{ ...held, run: 1 }], null].map((holds) => robot({ holds })),
    ...[[null], [{ code: "moves_again" }], null].map((alarms) => open({ alarms })),
    ...[{ unconfirmed: {} }, { actions: { Lift_0: null } }, { rests: [null] }].map(open),
    open({ rests: [{ robot: "Eve", state: "unproven", why: 1 }] }),
    { engines: [null], runs: [] },
    { engines: [], runs: [null] },
  ];
  for (const said of odd) {
    hello(A.url, run("a", { desired: "stopped", unconfirmed: "Lift_0 does not obey" }));
    wireOf(B.url).say({ type: "hello", ...said });
    const [, b] = live.state.sites ?? [];
    expect([said, b?.state]).toMatchObject([said, { link: "down", unreached: { kind: "mute" } }]);
    expect(foreignGraphs(live.state)).toEqual([]);
    const notice = plain(wholeNotice(live.state, new Set(), performance.now() + 6_500)?.text);
    expect(notice).toContain("STOP UNCONFIRMED at Hall A: run 1");
    expect(notice).toContain("STOP CANNOT BE PROVEN HERE at Hall B");
    live.redial();
  }
  wireOf(B.url).say({ type: "hello", ...robot({ holds: [held] }) });
  expect(foreignGraphs(live.state)).toHaveLength(1);
  failed.mockRestore();
});

test("a site whose clock is ahead makes nothing of the others older, and its own is as old as it is", async () => {
  live.setSites([A, B]);
  live.setJoiner(new SitesJoiner());
  for (const { url } of [A, B]) hello(url);
  const now = Date.UTC(2026, 10, 30, 10);
  const beat = (url: string, at: number, run: string) => {
    const text = (ms: number) => new Date(ms).toISOString();
    wireOf(url).say({ type: "beat", at: text(at), seen: { [run]: text(at - 400) }, heard: {} });
  };
  for (let each = 0; each < 12; each += 1) beat(A.url, now, "a"); // stamps of earlier tests are forgotten
  beat(B.url, now + 60_000, "b");
  beat(A.url, now, "a");
  expect(Math.round(serverNow() - now)).toBe(0);
  hello(B.url, run("b"));
  for (const id of ["a", "b"]) {
    expect(Math.round(serverNow() - (live.runSeenAt.get(id) ?? 0))).toBe(400);
  }
  expect(Math.round(shiftOfRun("b"))).toBe(-60_000);
  const shift = shiftOfRun("b");
  beat(B.url, now + 60_040, "b"); // a message that was quicker
  expect(shiftOfRun("b")).toBe(shift); // nothing is drawn anew
  const begun = new Date(now + 60_000 - 5_000).toISOString(); // five seconds ago, by its own clock
  const visit = { from: begun, not_before: begun, until: null, not_after: null };
  const action = { aid: "A", state: "RUNNING", count: 1, visits: [visit], messages: [] };
  const going = run("b", { actions: { A: action } }) as unknown as Run;
  const { since } = progressByAid(going, false).get("A") ?? {};
  expect(Math.round(serverNow() - (since ?? 0))).toBe(5_000);
});
