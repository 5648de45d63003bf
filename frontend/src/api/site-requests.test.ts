/** Which site a request goes to, and how the answers of several become one. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { runnerAt } from "./client";
import { listComparable } from "./review";
import { registerRobot } from "./robots";
import { setKnowledge, siteRouter } from "./site-requests";
import { newerFirst, type Site, setSiteRouter, setSites } from "./sites";
import { unsaidSites } from "./unsaid-sites";

const A: Site = { name: "Hall A", url: "http://lab:8001" };
const B: Site = { name: "Hall B", url: "http://lab:8011" };
const robots = new Map<Site, readonly string[] | null>();
const live = new Set<Site>();
/** Milliseconds by which the clock of a site is behind that of the page. */
const shifts = new Map<Site, number>();
/** What each site answers, by method and path; an error stands for a site that does not answer. */
let answers: Record<string, unknown>;
let asked: string[];

beforeEach(() => {
  robots.clear();
  shifts.clear();
  robots.set(A, ["simulator", "Carl"]).set(B, ["simulator", "Dora"]);
  for (const site of [A, B]) live.add(site);
  setSites([A, B]);
  setKnowledge((site) => ({
    isLive: live.has(site),
    robots: robots.get(site) === null ? null : new Set(robots.get(site)),
    hasRun: (id) => id === (site === B ? "ofB" : "ofA"),
    shift: shifts.get(site) ?? 0,
  }));
  setSiteRouter(siteRouter);
  answers = {};
  asked = [];
  vi.stubGlobal("fetch", async (url: string, { method }: RequestInit) => {
    const said = `${method} ${url.replace("http://lab:", "")}`;
    asked.push(said);
    const [found] = Object.entries(answers)
      .filter(([key]) => said.startsWith(key))
      .sort(([a], [b]) => b.length - a.length);
    if (found === undefined) return new Response("{}", { status: 404 });
    if (found[1] instanceof Error) throw found[1];
    if (found[1] instanceof Response) return found[1].clone();
    return Response.json(found[1]);
  });
});

afterEach(() => {
  setSiteRouter(undefined);
  setSites([]);
  vi.unstubAllGlobals();
});

const runner = runnerAt(A.url);
const start = (body: object) => runner.post("/api/runs", { body: body as never });

test("a start goes to the site of its robot, once", async () => {
  answers = { POST: { id: "new" } };
  await start({ engine: "Dora", request_id: "x" });
  await start({ engine: "conducted", robots: { a: "Dora", b: "simulator" } });
  await start({ engine: "simulator" });
  expect(asked).toEqual(["POST 8011/api/runs", "POST 8011/api/runs", "POST 8001/api/runs"]);
});

test("what became of a start is asked where it was sent", async () => {
  answers = { "": { runs: [], under_way: false, queued: null } };
  await start({ engine: "Dora", request_id: "mine" });
  asked = [];
  await runner.get("/api/starts/{request_id}", { path: { request_id: "mine" } });
  expect(asked).toEqual(["GET 8011/api/starts/mine"]);
});

test("a start is not said to be nowhere while a site does not answer", async () => {
  const none = { runs: [], under_way: false, queued: null };
  const look = () => runner.get("/api/starts/{request_id}", { path: { request_id: "lost" } });
  answers = { "GET 8001": none, "GET 8011": none };
  expect((await look()).runs).toEqual([]);
  answers = { "GET 8001": none, "GET 8011": new TypeError("refused") };
  await expect(look()).rejects.toThrow("The runner of Hall B does not answer.");
  answers = { "GET 8001": { ...none, runs: [{ id: "r" }] }, "GET 8011": new TypeError("refused") };
  expect((await look()).runs).toEqual([{ id: "r" }]);
});

test("robots of two sites in one start are refused, and nothing is sent", async () => {
  const both = start({ engine: "conducted", robots: { a: "Carl", b: "Dora" } });
  await expect(both).rejects.toThrow("of several sites: Carl at Hall A; Dora at Hall B.");
  robots.set(A, ["Dora"]);
  await expect(start({ engine: "Dora" })).rejects.toThrow("Dora at Hall A and Hall B");
  expect(asked).toEqual([]);
});

test("a robot that nobody knows is not started while a site has not said its robots", async () => {
  robots.set(B, null);
  await expect(start({ engine: "Dora" })).rejects.toThrow("It is not known where Dora is: Hall B");
  expect(asked).toEqual([]);
});

test("what concerns a run goes to its site, and an unknown one is looked for", async () => {
  answers = { "GET 8011/api/runs/else": { id: "else" }, "POST 8011": {} };
  await runner.post("/api/runs/{run}/pause", { path: { run: "ofB" } });
  await runner.get("/api/runs/{run}", { path: { run: "else" } });
  await runner.post("/api/runs/{run}/pause", { path: { run: "else" } });
  expect(asked).toEqual([
    "POST 8011/api/runs/ofB/pause",
    "GET 8001/api/runs/else",
    "GET 8011/api/runs/else",
    "POST 8011/api/runs/else/pause",
  ]);
});

test("runs of both are one list by time, page by page", async () => {
  const at = (id: string, second: number) => ({
    id,
    requested_at: `2026-11-30T10:00:0${second}Z`,
  });
  answers = {
    "GET 8001/api/runs?limit=2&before=a2": [at("a1", 1)],
    "GET 8001/api/runs?limit=2": [at("a3", 5), at("a2", 3)],
    "GET 8011/api/runs?limit=2&before=b2": [at("b1", 2)],
    "GET 8011/api/runs?limit=2": [at("b2", 4), at("b1", 2)],
  };
  const page = async (before?: string) =>
    (await runner.get("/api/runs", { query: { limit: 2, before } })).map(({ id }) => id);
  expect(await page()).toEqual(["a3", "b2"]);
  answers["GET 8001/api/runs?limit=2&before=a3"] = [at("a2", 3), at("a1", 1)];
  expect(await page("b2")).toEqual(["a2", "b1"]);
  answers["GET 8011/api/runs?limit=2&before=b1"] = [];
  expect(await page("b1")).toEqual(["a1"]);
});

test("a site that does not answer hides no run of the others", async () => {
  answers = { "GET 8001": [{ id: "a", requested_at: "2026-11-30T10:00:00Z" }] };
  answers["GET 8011"] = new TypeError("refused");
  expect(await runner.get("/api/runs", { query: { limit: 2 } })).toHaveLength(1);
});

test("a site that answers with an error or with garbage is named, and hides nothing of the others", async () => {
  const waiting = { questions: [{ question: { id: "q" } }] };
  const runs = [{ id: "a", number: 1, requested_at: "2026-11-30T10:00:00Z" }];
  answers = { "GET 8001/api/questions": waiting, "GET 8001/api/runs": runs };
  const lacking = (route: string) => unsaidSites(route).map(({ site, why }) => [site.name, why]);
  const cannot = ["Hall B", "What it says cannot be read."];
  for (const [said, named] of [
    [new Response("broken", { status: 500 }), ["Hall B", "The server answered 500."]],
    [new Response("<html>", { status: 200 }), ["Hall B", expect.stringContaining("JSON")]],
    [{}, cannot],
    ["text", cannot],
    [{ questions: {} }, cannot],
    [{ questions: [null] }, cannot],
  ] as const) {
    answers["GET 8011"] = said;
    expect(await runner.get("/api/questions", {})).toEqual(waiting);
    expect(await runner.get("/api/runs", { query: { limit: 9 } })).toEqual(runs);
    for (const route of ["questions", "runs"])
      expect(lacking(`get /api/${route}`)).toEqual([named]);
  }
  answers["GET 8001"] = new Response("broken", { status: 500 });
  answers = { ...answers, "GET 8011": { questions: [] }, "GET 8001/api/questions": {} };
  expect(await runner.get("/api/questions", {})).toEqual({ questions: [] });
  expect(lacking("get /api/questions")).toEqual([["Hall A", "What it says cannot be read."]]);
  answers["GET 8001/api/questions"] = waiting;
  await runner.get("/api/questions", {});
  expect(lacking("get /api/questions")).toEqual([]);
});

test("runs of sites with wrong clocks are in the order of time", async () => {
  const at = (id: string, number: number, second: number) => ({
    ...{ id, number },
    requested_at: new Date(Date.UTC(2026, 10, 30, 10, 0, second)).toISOString(),
  });
  shifts.set(B, -60_000); // it is a minute ahead
  const [a, b] = [at("ofA", 7, 40), at("ofB", 900, 90)]; // the second is ten seconds older
  answers = { "GET 8001": [a], "GET 8011": [b] };
  const listed = await runner.get("/api/runs", { query: { limit: 2 } });
  expect(listed.map(({ id }) => id)).toEqual(["ofA", "ofB"]);
  expect([b, a].sort(newerFirst).map(({ id }) => id)).toEqual(["ofA", "ofB"]);
  setSites([]); // one runner: its own count
  expect([a, b].sort(newerFirst).map(({ id }) => id)).toEqual(["ofB", "ofA"]);
});

test("a revocation is told to both, and who was not reached is named", async () => {
  answers = { "POST 8001": {}, "POST 8011": new TypeError("refused") };
  const told = runner.post("/api/revocations", { body: { person: "p" } });
  await expect(told).rejects.toThrow("Hall B: The runner of Hall B does not answer.");
  expect(asked.sort()).toEqual(["POST 8001/api/revocations", "POST 8011/api/revocations"]);
});

test("the name of a robot is unique, and not given while another site is silent", async () => {
  const robot = { name: "Dora" } as Parameters<typeof registerRobot>[1];
  await expect(registerRobot(A.url, robot)).rejects.toThrow("Dora is registered at Hall B");
  robots.set(B, []);
  live.delete(B);
  await expect(registerRobot(A.url, robot)).rejects.toThrow("Hall B does not say its robots");
  live.add(B);
  answers = { POST: { name: "Dora" } };
  await registerRobot(A.url, robot);
  expect(asked).toEqual(["POST 8001/api/robots"]);
});

test("each engine is looked at by its own site, in the order that was asked for", async () => {
  answers = { "POST 8001": [{ engine: "Carl" }], "POST 8011": [{ engine: "Dora" }] };
  const body = { engines: ["Dora", "Carl"] } as never;
  const looks = await runner.post("/api/preflight", { body });
  expect(looks.map(({ engine }) => engine)).toEqual(["Dora", "Carl"]);
});

test("others are asked for their yes by the site of the robots, which has looked at the order", async () => {
  answers = { POST: { receivers: 1 } };
  const body = { digest: "d", robots: ["Dora"], graph_name: "g", version: "v" };
  await runner.post("/api/approvals/asked", { body: body as never });
  expect(asked).toEqual(["POST 8011/api/approvals/asked"]);
});

test("Stop of a robot goes to each site that may have it", async () => {
  answers = { POST: {} };
  const stop = (name: string) => runner.post("/api/robots/{name}/stop", { path: { name } });
  await stop("Dora");
  robots.set(A, ["Dora"]);
  await stop("Dora");
  robots.set(A, null).set(B, null);
  await stop("Dora");
  expect(asked.map((each) => each.slice(5, 9))).toEqual(["8011", "8001", "8011", "8001", "8011"]);
});

test("Stop of a robot goes to a site that has not said its robots as well", async () => {
  answers = { "POST 8011": {}, "POST 8001": new TypeError("refused") };
  robots.set(A, null);
  await runner.post("/api/robots/{name}/stop", { path: { name: "Dora" } });
  expect(asked.map((each) => each.slice(5, 9)).sort()).toEqual(["8001", "8011"]);
});

test("a session that one site does not know any more has ended there", async () => {
  vi.stubGlobal("fetch", async (url: string) =>
    url.startsWith(A.url)
      ? Response.json({ status: 401, type: "unauthenticated" }, { status: 401 })
      : new Response(null, { status: 204 }),
  );
  await expect(runner.delete("/api/session", {})).resolves.toBeUndefined();
});

test("runs of two sites are not compared, and those that may be compared are asked of the run's site alone", async () => {
  const compare = (a: string, b: string) => runner.get("/api/comparison", { query: { a, b } });
  await expect(compare("ofA", "ofB")).rejects.toThrow(
    "One run is of Hall A, the other of Hall B, and a runner knows only its own runs.",
  );
  expect(asked).toEqual([]);
  answers = { "GET 8011": [] };
  await compare("unknown", "ofB");
  const { signal } = new AbortController();
  await listComparable(A.url, "ofB", "g", "ofB", 1, signal);
  answers = { "GET 8001": [] };
  await listComparable(A.url, "ofA", "g", null, 200, signal);
  expect(asked).toEqual([
    "GET 8011/api/comparison?a=unknown&b=ofB",
    "GET 8011/api/runs?graph=g&limit=1&before=ofB",
    "GET 8001/api/runs?graph=g&limit=200",
  ]);
});
