import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { serverNow } from "../clock/server-clock";
import { Wire } from "../testing/wire";
import { sessionEnd } from "./http";
import { LiveSocket } from "./live-socket";
import type { Run } from "./runs";
import "./unreached"; // it is loaded when it is needed, and time stands still here

const newest = () => {
  const wire = Wire.all.at(-1);
  if (!wire) throw new Error("no socket was opened");
  return wire;
};

const run = (state: string, ended: string | null = null) =>
  ({ id: "r", number: 1, state, ended_at: ended, alarms: [] }) as unknown as Run;

/** A link to a runner in which these runs go on. */
function opened(...runs: object[]): LiveSocket {
  const live = new LiveSocket("http://h:1");
  live.open();
  newest().say({ type: "hello", engines: [], runs });
  return live;
}

const posted = vi.fn();

beforeEach(() => {
  vi.useFakeTimers();
  Wire.all = [];
  posted.mockReset();
  vi.stubGlobal("WebSocket", Wire);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    posted(init.method, url);
    const body = url.endsWith("/api/runs/r") ? run("lost", "2026-01-01T00:00:00Z") : { runs: [] };
    return new Response(JSON.stringify(body), { status: 200 });
  });
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

test("a socket that is closed because the session ended says so at once", () => {
  const live = new LiveSocket("http://127.0.0.1:8001");
  live.open();
  newest().close(1006);
  expect(sessionEnd.now()).toBe(false);
  vi.advanceTimersByTime(1_000);
  newest().close(4401);
  expect(sessionEnd.now()).toBe(true);
  sessionEnd.clear();
  live.close();
});

test("one socket, by the runner's own address", () => {
  const live = new LiveSocket("https://robots.example/runner");
  live.open();
  expect(Wire.all.map((wire) => wire.url)).toEqual(["wss://robots.example/runner/api/live"]);
  live.close();
});

test("a runner that falls silent is unknown, and asked again", async () => {
  const live = opened(run("running"));
  expect(live.state.link).toBe("live");
  await vi.advanceTimersByTimeAsync(3_000);
  expect(live.state.link).toBe("live");
  newest().say({ type: "beat", at: "" });
  await vi.advanceTimersByTimeAsync(4_000);
  expect(live.state.link).toBe("down");
  expect(live.state.runs.get("r")?.state).toBe("running");
  await vi.advanceTimersByTimeAsync(1_000);
  expect(Wire.all.length).toBe(2);
  live.close();
});

test("only a visible page answers when the runner asks whether it is there", () => {
  const live = opened(run("running"));
  const page = { visibilityState: "hidden" };
  vi.stubGlobal("document", page);
  newest().say({ type: "there", number: 7 });
  expect(newest().sent).toEqual([]);
  page.visibilityState = "visible";
  newest().say({ type: "there", number: 8 });
  expect(newest().sent.map((text) => JSON.parse(text))).toEqual([{ type: "here", number: 8 }]);
  live.close();
});

test("Stop goes by socket and by POST at once", async () => {
  const live = opened(run("running"));
  live.stop("r");
  expect(JSON.parse(newest().sent[0] ?? "")).toMatchObject({ type: "stop", run: "r" });
  expect(posted).toHaveBeenCalledWith("POST", "http://h:1/api/runs/r/stop");
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state.stops.at(-1)?.state).toBe("heard");
  expect(live.state.runs.get("r")?.state).toBe("running");
  live.close();
});

test("that a Stop is proven is noted when the runner says so, and stays when it falls silent", async () => {
  const live = opened({ ...run("running"), alarms: [] });
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  newest().say({ type: "run", run: { ...run("stopped", "2026-01-01T00:00:00Z"), alarms: [] } });
  const proven = live.state.stops[0]?.provenAt;
  expect(proven).toBeDefined();
  await vi.advanceTimersByTimeAsync(4_000);
  expect(live.state.link).toBe("down");
  expect(live.state.stops[0]?.provenAt).toBe(proven);
  live.close();
});

test("nothing is noted as proven while a robot's graphs, or the robot itself, are not known to rest", async () => {
  for (const engine of [
    { name: "David", state: "answering", holds: [{ graph: "theirs", active: true, run: null }] },
    { name: "David", state: "silent", holds: [] },
  ]) {
    const live = new LiveSocket("http://h:1");
    live.open();
    newest().say({ type: "hello", engines: [engine], runs: [] });
    live.stop("all");
    await vi.advanceTimersByTimeAsync(10);
    expect(live.state.stops[0]).toMatchObject({ state: "heard" });
    expect(live.state.stops[0]?.provenAt).toBeUndefined();
    live.close();
  }
});

/** What the runner answers to each Stop. */
const STOPPING = { type: "stopping", stop_id: "", runs: [], graphs: {}, unknown: {} };
const BEAT = { type: "beat", at: "" };

test("nothing is proven before the socket says something after the Stop was heard", async () => {
  const live = opened();
  live.stop("all"); // no message comes any more, and POST goes
  await vi.advanceTimersByTimeAsync(3_000);
  expect(live.state).toMatchObject({ link: "live", stops: [{ state: "heard" }] });
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  newest().say(BEAT);
  expect(live.state.stops[0]?.provenAt).toBeDefined();
  live.close();
});

test("a Stop is about the runs that its answer names, also those that this page has not seen", async () => {
  for (const what of ["all", "both"]) {
    answering({ stop: [202, { ...STOPPING, runs: ["r", "q", "led.2"] }] });
    const live = opened({ ...run("running"), group: "both" });
    live.stop(what);
    await vi.advanceTimersByTimeAsync(10);
    newest().say(BEAT);
    const ended = { ...run("stopped", "2026-01-01T00:00:00Z"), group: "both" };
    newest().say({ type: "run", run: ended });
    expect(live.state.stops[0]?.runs).toEqual(["r", "q", "led"]); // of its pieces nothing is told
    expect(live.state.stops[0]?.provenAt).toBeUndefined();
    newest().say({ type: "run", run: { ...ended, id: "q" } });
    expect(live.state.stops[0]?.provenAt).toBeUndefined();
    newest().say({ type: "run", run: { ...ended, id: "led" } });
    expect(live.state.stops[0]?.provenAt).toBeDefined();
    live.close();
  }
});

test("a Stop whose answer names graphs or silent robots is not proven before the robots are told", async () => {
  const robot = { name: "Dora", state: "answering", holds: [] };
  for (const more of [{ graphs: { Dora: ["theirs"] } }, { unknown: { Dora: "No link." } }]) {
    for (const isBySocket of [false, true]) {
      answering(isBySocket ? {} : { stop: [202, { ...STOPPING, ...more }] });
      const live = new LiveSocket("http://h:1");
      live.open();
      newest().say({ type: "hello", engines: [robot], runs: [] });
      live.stop("all");
      const { stop_id } = JSON.parse(newest().sent[0] ?? "");
      if (isBySocket) newest().say({ ...STOPPING, ...more, stop_id });
      await vi.advanceTimersByTimeAsync(10);
      newest().say(BEAT);
      expect(live.state.stops[0]).toMatchObject({ state: "heard" });
      expect(live.state.stops[0]?.provenAt).toBeUndefined();
      newest().say({ type: "engines", engines: [robot] });
      expect(live.state.stops[0]?.provenAt).toBeDefined();
      live.close();
    }
  }
});

test("the end of a run that began, was stopped and ended unseen is asked for", async () => {
  const began = { ...run("stopped", "2026-01-01T00:00:00Z"), id: "began" };
  answering({
    "/api/stop": [202, { ...STOPPING, runs: ["began"] }],
    "/api/runs/began": [200, began],
  });
  const live = opened();
  newest().close(1006);
  live.stop("all");
  await vi.advanceTimersByTimeAsync(1_000);
  newest().say({ type: "hello", engines: [], runs: [] });
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  await vi.advanceTimersByTimeAsync(10);
  newest().say(BEAT);
  expect(live.state.runs.get("began")?.state).toBe("stopped");
  expect(live.state.stops[0]?.provenAt).toBeDefined();
  live.close();
});

test("a Stop is heard although the socket fails just then", async () => {
  const live = opened(run("running"));
  newest().send = () => {
    throw new DOMException("it is closing", "InvalidStateError");
  };
  const warned = vi.spyOn(console, "warn").mockImplementation(() => undefined);
  live.stop("r");
  await vi.advanceTimersByTimeAsync(10);
  expect(posted).toHaveBeenCalledWith("POST", "http://h:1/api/runs/r/stop");
  expect(live.state.stops.at(-1)?.state).toBe("heard");
  expect(warned).toHaveBeenCalledOnce();
  warned.mockRestore();
  live.close();
});

test("a Stop that nobody hears is sent again until somebody does", async () => {
  const live = opened(run("running"));
  const bodies: { stop_id: string; again: boolean }[] = [];
  let dead = true;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (init.method === "POST") {
      posted("POST", url);
      bodies.push(JSON.parse(String(init.body)));
    }
    if (dead) throw new TypeError("no network");
    return Response.json({ runs: [] }, { status: 202 });
  });
  live.stop("all");
  newest().close();
  await vi.advanceTimersByTimeAsync(20_000);
  expect(live.state.stops.at(-1)?.state).toBe("unheard");
  const tries = posted.mock.calls.length;
  expect(tries).toBeGreaterThan(10);
  expect(posted).toHaveBeenLastCalledWith("POST", "http://h:1/api/stop");
  dead = false;
  await vi.advanceTimersByTimeAsync(2_000);
  expect(live.state.stops.at(-1)?.state).toBe("heard");
  const heard = posted.mock.calls.length;
  await vi.advanceTimersByTimeAsync(10_000);
  expect(posted.mock.calls.length).toBe(heard);
  // So the runner tells another try from another press.
  expect(new Set(bodies.map(({ stop_id }) => stop_id)).size).toBe(1);
  expect(bodies.map(({ again }) => again)).toEqual(bodies.map((_, n) => n > 0));
  live.close();
});

test("an answer that names no runs is none of the runner, and the Stop is sent again", async () => {
  const live = opened(run("running"));
  newest().close();
  for (const answer of [{ status: "ok" }, { runs: [{}] }]) {
    vi.stubGlobal("fetch", async () => Response.json(answer));
    live.stop("all");
    await vi.advanceTimersByTimeAsync(2_000);
    expect(live.state.stops.at(-1)?.state).toBe("unheard");
  }
  live.close();
});

test("what was unknown when all was to be stopped is stopped, however late it is heard", async () => {
  answering({});
  const live = new LiveSocket("http://h:1"); // nothing was heard of any run yet
  live.open();
  live.stop("all");
  await vi.advanceTimersByTimeAsync(20_000);
  expect(live.state.stops.at(-1)?.state).toBe("unheard");
  posted.mockReset();
  answering({ "/api/stop": 202 });
  await vi.advanceTimersByTimeAsync(1_500);
  expect(posted).toHaveBeenCalledWith("POST", "http://h:1/api/stop");
  expect(live.state.stops.at(-1)?.state).toBe("heard");
  live.close();
});

test("a Stop of everything that gets lost reaches a run that began unseen right before it", async () => {
  const live = opened(run("running"));
  answering({}); // the cable is out right after a message: what begins from now on is not seen here
  await vi.advanceTimersByTimeAsync(1_400);
  live.stop("all");
  await vi.advanceTimersByTimeAsync(20_000);
  const paths = new Set(
    posted.mock.calls.filter(([method]) => method === "POST").map(([, url]) => url),
  );
  expect([...paths]).toEqual(["http://h:1/api/stop"]);
  newest().say({
    type: "hello",
    engines: [],
    runs: [run("running"), { ...run("running"), id: "q" }],
  });
  answering({ "/api/stop": 202 });
  await vi.advanceTimersByTimeAsync(1_500);
  expect(live.state.stops.at(-1)).toMatchObject({ state: "heard", runs: ["r", "q"] });
  live.close();
});

test("a Stop that nobody has heard is not crowded out by others", async () => {
  const live = new LiveSocket("http://h:1");
  live.open();
  answering({});
  live.stop("r");
  for (let n = 0; n < 9; n += 1) live.stop(`other${n}`);
  for (let n = 0; n < 9; n += 1) live.stop("all"); // a key that is held down
  await vi.advanceTimersByTimeAsync(3_000);
  expect(live.state.stops.map((stop) => stop.run)).toHaveLength(11);
  posted.mockReset();
  answering({ "/stop": 202 });
  await vi.advanceTimersByTimeAsync(2_000);
  expect(posted).toHaveBeenCalledWith("POST", "http://h:1/api/runs/r/stop");
  expect(posted.mock.calls.filter(([, url]) => url === "http://h:1/api/stop")).toHaveLength(1);
  expect(live.state.stops.every((stop) => stop.state === "heard")).toBe(true);
  live.close();
});

test("a Stop that is not proven is not crowded out by others, and those of one target are one", async () => {
  const others = Array.from({ length: 9 }, (_, n) => ({ ...run("running"), id: `other${n}` }));
  const live = opened(run("running"), ...others);
  const press = async (what: string) => {
    live.stop(what);
    await vi.advanceTimersByTimeAsync(10);
    newest().say(BEAT);
  };
  const lost = { ...run("lost", "2026-01-01T00:00:00Z"), detail: "It was restarted." };
  await press("r");
  newest().say({ type: "run", run: lost });
  await press("all"); // about the others
  for (const { id } of others) await press(id);
  for (let n = 0; n < 9; n += 1) await press("all");
  const targets = live.state.stops.map((stop) => stop.run);
  expect(new Set(targets)).toEqual(new Set(["r", "all", ...others.map(({ id }) => id)]));
  expect(targets).toHaveLength(12); // the last press is joined with the one before when the next one comes
  for (const { id } of others)
    newest().say({ type: "run", run: { ...lost, state: "stopped", id } });
  await vi.advanceTimersByTimeAsync(1_000);
  newest().say(BEAT);
  for (let n = 0; n < 9; n += 1) await press("all");
  const unproven = live.state.stops.filter(({ provenAt }) => provenAt === undefined);
  expect(unproven.map((stop) => stop.run)).toEqual(["r"]);
  expect(live.state.stops).toHaveLength(6);
  live.close();
});

test("a Stop that is asked for anew is about what the one before was about", async () => {
  const live = opened(run("running"));
  answering({});
  live.stop("all");
  newest().say({ type: "run", run: { ...run("lost", "2026-01-01T00:00:00Z") } });
  live.stop("all");
  expect(live.state.stops).toMatchObject([{ state: "asked", runs: ["r"] }]);
  answering({ stop: 202 });
  for (let n = 0; n < 3; n += 1) {
    live.stop("all"); // each is heard, and the first one not proven
    await vi.advanceTimersByTimeAsync(10);
  }
  expect(live.state.stops).toMatchObject([{ runs: ["r"] }, { runs: [] }]);
  live.close();
});

test("only an answer that says so says that a runner does not have a run", async () => {
  const live = opened();
  answering({ stop: [403, { type: "forbidden", detail: "not you" }] });
  live.stop("x");
  const { stop_id } = JSON.parse(newest().sent[0] ?? "");
  newest().say({ type: "refused", stop_id, detail: "not you" });
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state.stops.at(-1)).toMatchObject({ state: "refused", detail: "not you" });
  expect(live.state.stops.at(-1)?.isAbsent).toBeUndefined();
  answering({ stop: [404, { type: "not_found", detail: "no such run" }] });
  live.stop("x");
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state.stops.at(-1)).toMatchObject({ state: "refused", isAbsent: true });
  live.close();
});

test("a Stop of everything that is pressed while the runner is silent stays one, and stops what began meanwhile", async () => {
  const live = opened(run("running"));
  newest().close(1006);
  answering({});
  await vi.advanceTimersByTimeAsync(60_000);
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10_000);
  posted.mockReset();
  newest().say({ type: "hello", engines: [], runs: [{ ...run("running"), id: "began" }] });
  answering({ "/api/stop": 202, "/api/runs/r": [200, run("finished", "2026-01-01T00:00:00Z")] });
  await vi.advanceTimersByTimeAsync(1_500);
  expect(posted).toHaveBeenCalledWith("POST", "http://h:1/api/stop");
  const [stop] = live.state.stops;
  expect(stop).toMatchObject({ state: "heard", runs: ["r", "began"] });
  expect(stop?.provenAt).toBeUndefined();
  live.close();
});

test("a Stop of everything that was heard before the runner is seen again is about what it stops", async () => {
  const live = opened(run("running"));
  newest().close(1006);
  await vi.advanceTimersByTimeAsync(60_000);
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state.stops[0]?.state).toBe("heard");
  await vi.advanceTimersByTimeAsync(20_000);
  const began = { ...run("stopping"), id: "began", desired: "stopped" };
  newest().say({ type: "hello", engines: [], runs: [began] });
  expect(live.state.stops[0]?.runs).toEqual(["r", "began"]);
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  live.close();
});

test("a Stop of everything that was heard over a socket that is half dead is about what it stops", async () => {
  const live = opened();
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state).toMatchObject({ link: "live", stops: [{ state: "heard" }] });
  await vi.advanceTimersByTimeAsync(20_000);
  expect(live.state.link).toBe("down"); // since its silence was noticed, after the answer
  const began = { ...run("stopping"), id: "began", desired: "stopped" };
  newest().say({ type: "hello", engines: [], runs: [began] });
  expect(live.state.stops[0]?.runs).toEqual(["began"]);
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  live.close();
});

test("a listener that fails, and a message that cannot be read, keep no Stop from being sent", () => {
  const said = vi.spyOn(console, "error").mockImplementation(() => undefined);
  const live = opened(run("running"));
  const other = vi.fn();
  live.subscribe(() => {
    throw new Error("not drawn");
  });
  live.subscribe(other);
  live.stop("all");
  expect(posted).toHaveBeenCalledWith("POST", "http://h:1/api/stop");
  expect(other).toHaveBeenCalled();
  for (const message of [{ type: "engines" }, { type: "engines", engines: [{ name: "David" }] }]) {
    newest().say(message);
    expect(live.state).toMatchObject({ link: "down", unreached: { kind: "mute" }, engines: [] });
    live.stop("all");
    live.redial();
    newest().say({ type: "hello", engines: [], runs: [] });
  }
  expect(posted.mock.calls.filter(([, url]) => url === "http://h:1/api/stop")).toHaveLength(3);
  expect(said).toHaveBeenCalled();
  said.mockRestore();
  live.close();
});

test("a Stop of everything is about the runs that went on then, and those that the runner stops since", async () => {
  const live = opened(run("running"));
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10);
  const said = (id: string, desired: string) =>
    newest().say({ type: "run", run: { ...run("running"), id, desired } });
  said("unseen", "stopped");
  said("calm", "running");
  expect(live.state.stops.at(-1)?.runs).toEqual(["r", "unseen"]);
  newest().say({ type: "beat", at: "" });
  await vi.advanceTimersByTimeAsync(3_000);
  newest().say({ type: "beat", at: "" });
  await vi.advanceTimersByTimeAsync(3_400);
  said("later", "stopped");
  expect(live.state.stops.at(-1)?.runs).toEqual(["r", "unseen"]);
  live.close();
});

test("how old a proof is does not follow from whose clock is right", () => {
  const live = opened();
  const theirs = Date.now() - 600_000; // the runner's clock is ten minutes behind
  const moment = (ms: number) => new Date(ms).toISOString();
  const beat = { type: "beat", at: moment(theirs), heard: {}, seen: { r: moment(theirs - 400) } };
  const age = () => serverNow() - (live.runSeenAt.get("r") ?? Number.NaN);
  newest().say(beat);
  expect(age()).toBeCloseTo(400);
  vi.advanceTimersByTime(2_000);
  newest().say(beat); // the same, two seconds under way
  expect(age()).toBeCloseTo(2_400);
  vi.setSystemTime(Date.now() + 3 * 3_600_000); // somebody sets the clock of this device
  expect(age()).toBeCloseTo(2_400);
  live.close();
});

test("when the runner has nothing to stop it with, a Stop is refused and not repeated", async () => {
  const live = new LiveSocket("http://h:1");
  live.open();
  const problem = { type: "forbidden", title: "Forbidden", status: 403, detail: "not you" };
  vi.stubGlobal("fetch", async () => new Response(JSON.stringify(problem), { status: 403 }));
  live.stop("r");
  await vi.advanceTimersByTimeAsync(5_000);
  expect(live.state.stops.at(-1)).toMatchObject({ state: "refused", detail: "not you" });
  live.close();
});

test("when only a proxy says no, a Stop is sent again", async () => {
  const live = new LiveSocket("http://h:1");
  live.open();
  const asked = vi.fn(async () => new Response("<h1>429</h1>", { status: 429 }));
  vi.stubGlobal("fetch", asked);
  live.stop("r");
  await vi.advanceTimersByTimeAsync(5_000);
  expect(live.state.stops.at(-1)).toMatchObject({ state: "unheard" });
  expect(asked.mock.calls.length).toBeGreaterThan(1);
  live.close();
});

test("a run that ended while the link was down is asked for", async () => {
  const live = opened(run("running"));
  newest().close();
  await vi.advanceTimersByTimeAsync(1_000);
  newest().say({ type: "hello", engines: [], runs: [] });
  await vi.advanceTimersByTimeAsync(10);
  expect(live.state.runs.get("r")?.state).toBe("lost");
  live.close();
});

/** The link breaks, and the runner that is there again does not name its run any more. */
async function endedUnseen(live: LiveSocket, ...others: object[]): Promise<void> {
  newest().close(1006);
  await vi.advanceTimersByTimeAsync(400);
  newest().say({ type: "hello", engines: [], runs: others });
  expect(live.state.link).toBe("live");
  await vi.advanceTimersByTimeAsync(100);
}

test("a Stop is not proven by a runner that does not name a run whose end is not known", async () => {
  const group = { ...run("running"), group: "both" };
  const q = { ...group, id: "q", number: 2 };
  for (const what of ["all", "r", "both"]) {
    answering({ stop: 202 });
    const live = opened(group, q);
    live.stop(what);
    await vi.advanceTimersByTimeAsync(10);
    await endedUnseen(live, { ...q, state: "stopped", ended_at: "2026-01-01T00:00:00Z" });
    expect(live.state.stops[0]).toMatchObject({ state: "heard" });
    expect(live.state.stops[0]?.provenAt).toBeUndefined();
    expect(live.state.runs.get("r")).toMatchObject({ state: "unknown", ended_at: null });
    answering({ "/api/runs/r": [200, { ...group, ...run("stopped", "2026-01-01T00:00:00Z") }] });
    for (let at = 0; at < 3; at += 1) {
      await vi.advanceTimersByTimeAsync(2_000);
      newest().say({ type: "beat", at: "" });
    }
    expect(live.state.runs.get("r")?.state).toBe("stopped");
    expect(live.state.stops[0]?.provenAt).toBeDefined();
    live.close();
  }
});

test("a Stop is not proven either where the runner does not know the run any more", async () => {
  answering({ stop: 202, "/api/runs/r": [404, { type: "not_found" }] });
  const live = opened(run("running"));
  live.stop("all");
  await vi.advanceTimersByTimeAsync(10);
  await endedUnseen(live);
  expect(live.state.runs.has("r")).toBe(false);
  expect(live.state.stops[0]?.provenAt).toBeUndefined();
  live.close();
});

test("a late answer about the end of a run hides nothing that was said of it since", async () => {
  const live = opened(run("running"));
  let answer: (response: Response) => void = () => undefined;
  vi.stubGlobal("fetch", () => new Promise<Response>((done) => (answer = done)));
  await endedUnseen(live);
  const moves = { ...run("running"), moves_again_at: "2026-01-01T00:00:05Z" };
  newest().say({ type: "run", run: moves });
  answer(Response.json(run("stopped", "2026-01-01T00:00:00Z")));
  await vi.advanceTimersByTimeAsync(100);
  expect(live.state.runs.get("r")).toMatchObject({ state: "running", ended_at: null });
  live.close();
});

test("a run that is told as it was draws nothing, and how it stands is told at once", () => {
  const live = new LiveSocket("http://h:1");
  live.open();
  const told = { ...run("running"), actions: {}, alarms: [] } as unknown as Run;
  newest().say({ type: "hello", engines: [], runs: [told] });
  const listener = vi.fn();
  live.subscribe(listener);
  newest().say({ type: "run", run: told });
  vi.advanceTimersByTime(1_000);
  expect(listener).not.toHaveBeenCalled();
  newest().say({ type: "run", run: { ...told, state: "stopping" } });
  expect(listener).toHaveBeenCalledTimes(1);
  expect(live.state.runs.get("r")?.state).toBe("stopping");
  live.close();
});

test("a new name dials anew without a moment of doubt", () => {
  const live = opened(run("running"));
  live.redial();
  expect(Wire.all.length).toBe(2);
  expect(Wire.all[0]?.readyState).toBe(3);
  expect(live.state.link).toBe("live");
  live.close();
});

test("a beat says when each robot last answered, without another render of everything", () => {
  const live = opened();
  const all = vi.fn();
  const seers = vi.fn();
  live.subscribe(all);
  live.subscribeSeen(seers);
  const at = new Date().toISOString();
  newest().say({ type: "beat", at, seen: {}, heard: { David: "1970-01-01T00:00:02Z" } });
  expect(live.robotAnsweredAt.get("David")).toBe(2000);
  expect(seers).toHaveBeenCalledOnce();
  expect(all).not.toHaveBeenCalled();
  live.close();
});

/** Serve these answers of the runner and the editor over HTTP. */
function answering(answers: Record<string, number | [number, object]>) {
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    posted(init.method ?? "GET", url);
    const [, found] = Object.entries(answers).find(([part]) => url.includes(part)) ?? [];
    if (found === undefined) throw new TypeError("no network");
    const [status, body] = Array.isArray(found) ? found : [found, { runs: [] }];
    return Response.json(body, { status });
  });
}

/** The socket is refused before it opens, again and again. */
async function refusing(seconds: number): Promise<void> {
  for (let i = 0; i < seconds * 10; i += 1) {
    if (newest().readyState === 1) newest().close(1006);
    await vi.advanceTimersByTimeAsync(100);
  }
}

test("a runner that an encrypted page may not ask is said to be so, and breaks nothing", async () => {
  vi.stubGlobal("location", new URL("https://robots.example/"));
  vi.stubGlobal("WebSocket", function refuse() {
    throw new DOMException("insecure", "SecurityError");
  });
  const live = new LiveSocket("http://robots.example:8001");
  live.open();
  await vi.advanceTimersByTimeAsync(1_000);
  expect(live.state.link).toBe("down");
  expect(live.state.unreached?.why).toContain("--public-url https://robots.example/");
  live.close();
});

test("once the session has ended nobody knocks again until somebody signs in", async () => {
  answering({ "/api/session": 401, "/api/reach": 401 });
  const live = new LiveSocket("http://h:1");
  live.open();
  await refusing(10);
  expect(sessionEnd.now()).toBe(true);
  const dialled = Wire.all.length;
  const asked = posted.mock.calls.length;
  await refusing(120);
  expect([Wire.all.length, posted.mock.calls.length]).toEqual([dialled, asked]);
  sessionEnd.clear();
  live.redial();
  expect(Wire.all.length).toBe(dialled + 1);
  live.close();
});

test("a runner that does not know a session which the editor knows ends no session", async () => {
  answering({ "/api/session": 200, "/api/reach": 401 });
  const live = new LiveSocket("http://h:1");
  live.open();
  await refusing(60);
  expect(sessionEnd.now()).toBe(false);
  expect(live.state.unreached?.why).toContain("does not know your session");
  expect(Wire.all.length).toBeLessThan(12);
  live.close();
});

test("a proxy that passes no sockets on is told from a runner that does not answer", async () => {
  answering({ "/api/reach": 200 });
  const live = new LiveSocket("https://robots.example/runner");
  live.open();
  await refusing(3);
  expect(live.state.unreached?.why).toContain("WebSockets");
  answering({});
  await refusing(10);
  expect(live.state.unreached?.why).toContain("does not answer");
  newest().say({ type: "hello", engines: [], runs: [] });
  expect(live.state.unreached).toBeNull();
  live.close();
});

test("a proxy that leads the runner's address elsewhere is told so", async () => {
  answering({ "/api/reach": [502, { type: "misrouted", title: "T", detail: "To the runner!" }] });
  const live = new LiveSocket("https://robots.example/runner");
  live.open();
  await refusing(3);
  expect(live.state.unreached?.why).toContain("To the runner!");
  live.close();
});
