/** How the page finds its runners, and hears of others while it is open. */
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { wholeNotice } from "../runs/stop/stop-notice";
import { plain } from "../testing/texts";
import { Wire } from "../testing/wire";

/** That of a page of its own for each test: a STOP ALL that is not proven outlives its person. */
let pageLink: typeof import("./page-link")["pageLink"];

const chunk = vi.hoisted(() => ({ fails: true }));
vi.mock("./live-sites", async (original) => {
  if (chunk.fails) throw new TypeError("Failed to fetch dynamically imported module");
  return await original();
});

const A = { name: "Hall A", url: "http://h:1" };
const B = { name: "Hall B", url: "http://h:2" };
const C = { name: "Hall C", url: "http://h:3" };

let runners: object[];
let asked: number;
let posted: string[];
const page = Object.assign(new EventTarget(), { hidden: false, querySelector: () => null });

const ADA = { id: "a", role: "operator", name: "Ada" } as const;
const BOB = { id: "b", role: "operator", name: "Bob" } as const;

beforeEach(async () => {
  vi.resetModules();
  ({ pageLink } = await import("./page-link"));
  vi.useFakeTimers();
  Wire.all = [];
  chunk.fails = true;
  runners = [A, B];
  asked = 0;
  posted = [];
  page.hidden = false;
  vi.stubGlobal("WebSocket", Wire);
  vi.stubGlobal("document", page);
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (init.method === "POST") posted.push(url);
    if (!url.endsWith("/api/config")) return Response.json({ runs: [] });
    asked += 1;
    const several = runners.length > 1 ? { runners } : {};
    return Response.json({ runner_url: A.url, ...several });
  });
  pageLink.enter(ADA, 1);
  await pass(10);
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

/** Let time go by, and what is loaded in it come. */
async function pass(ms: number): Promise<void> {
  for (const part of [ms - 2, 1, 1]) {
    await vi.advanceTimersByTimeAsync(part);
    await vi.dynamicImportSettled();
  }
}

const hear = () => {
  for (const wire of Wire.all) wire.say({ type: "hello", engines: [], runs: [] });
};

test("STOP ALL reaches each site while a part of the page does not load, and the page goes on trying", async () => {
  expect(pageLink.now().live?.state.unreached?.why).toContain("STOP goes to each runner");
  expect(pageLink.now().runner).toBeUndefined(); // nothing is asked of one site that is meant for all
  hear();
  pageLink.now().live?.stop("all");
  expect(posted).toEqual([`${A.url}/api/stop`, `${B.url}/api/stop`]);
  chunk.fails = false;
  await vi.waitFor(() => expect(pageLink.now().runner).toBe(A.url));
  expect(pageLink.now().live?.state.link).toBe("live");
  expect(pageLink.now().live?.state.stops).toHaveLength(1);
});

test("a page that is looked at hears of another runner, and shows it", async () => {
  chunk.fails = false;
  await pass(6_000);
  runners = [A, B, C];
  await pass(31_000);
  const names = pageLink.now().live?.state.sites?.map(({ site }) => site.name);
  expect(names).toEqual(["Hall A", "Hall B", "Hall C"]);
  page.hidden = true;
  await pass(30_000);
  asked = 0;
  await pass(300_000);
  expect(asked).toBe(0);
});

test("STOP ALL asks whether there are others, and stops at these too", async () => {
  chunk.fails = false;
  await pass(6_000);
  hear();
  runners = [A, B, C];
  pageLink.now().live?.stop("all");
  await pass(10);
  expect(posted).toEqual([A, B, C].map(({ url }) => `${url}/api/stop`));
});

test("STOP ALL waits for no pause between two tries to hear of the runners", async () => {
  chunk.fails = false;
  await pass(6_000);
  hear();
  const answered = fetch;
  let tries = 0;
  let isSilent = true;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (!url.endsWith("/api/config") || !isSilent) return answered(url, init);
    tries += 1;
    throw new TypeError("no answer");
  });
  while (tries < 6) await pass(100); // the next try comes five seconds later
  isSilent = false;
  runners = [A, B, C];
  pageLink.now().live?.stop("all");
  await pass(10);
  expect(posted).toEqual([A, B, C].map(({ url }) => `${url}/api/stop`));
});

/** Let the runner at B answer nothing until it is let. Returns that, and the ids of the Stops that it hears. */
function silence() {
  const answered = fetch;
  const heard: string[] = [];
  let isSilent = true;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (!url.startsWith(B.url)) return answered(url, init);
    if (isSilent) throw new TypeError("no answer");
    heard.push(JSON.parse(String(init.body)).stop_id);
    return Response.json({ runs: [] });
  });
  const end = () => {
    isSilent = false;
  };
  return { heard, end };
}

test("a STOP ALL that no runner has heard as the session ends is sent on, and shown until it is proven", async () => {
  chunk.fails = false;
  await pass(6_000);
  hear();
  const { heard, end } = silence();
  pageLink.now().live?.stop("all");
  const [stop] = pageLink.now().live?.state.stops ?? [];
  await pass(100);
  pageLink.leave();
  await pass(5_000);
  expect(pageLink.now()).toMatchObject({ signedIn: true });
  expect(pageLink.now().live?.state.stops).toMatchObject([{ id: stop?.id, state: "unheard" }]);
  end();
  await pass(1_100);
  expect(heard).toEqual([stop?.id]);
  hear(); // the runner says what runs: nothing, so it is proven
  expect(pageLink.now()).toMatchObject({ live: null, signedIn: false });
});

test("a Stop of one run that no runner has heard as the session ends is sent on, too", async () => {
  chunk.fails = false;
  await pass(6_000);
  hear();
  const { heard, end } = silence();
  pageLink.now().live?.stop("r");
  const [stop] = pageLink.now().live?.state.stops ?? [];
  await pass(100);
  pageLink.leave();
  await pass(5_000);
  expect(pageLink.now()).toMatchObject({ signedIn: true });
  end();
  await pass(1_100);
  expect(heard).toEqual([stop?.id]);
});

test("whoever signs in while a STOP ALL is not proven keeps it, and dials anew", async () => {
  chunk.fails = false;
  await pass(6_000);
  hear();
  silence();
  pageLink.now().live?.stop("all");
  pageLink.leave();
  const before = Wire.all.length;
  pageLink.enter(ADA, 1);
  expect(Wire.all.length - before).toBe(2);
  await pass(100);
  hear();
  expect(pageLink.now().live?.state.stops).toMatchObject([{ state: "unheard" }]);
  expect(pageLink.now().signedIn).toBe(true);
});

const said = () => {
  const now = pageLink.now().live?.state;
  return now && plain(wholeNotice(now, new Set(), performance.now())?.text);
};

test("a STOP ALL that no runner has heard is not sent in the name of somebody else, and the notice says so", async () => {
  chunk.fails = false;
  await pass(6_000);
  pageLink.enter({ ...ADA, role: "viewer" }, 2);
  hear();
  const { heard, end } = silence();
  pageLink.now().live?.stop("all");
  await pass(100);
  pageLink.leave();
  await pass(100);
  pageLink.enter(ADA, 3);
  expect(pageLink.now().live?.state.stops).toMatchObject([{ state: "unheard" }]); // the same person
  pageLink.leave();
  pageLink.enter(BOB, 4);
  await pass(10);
  hear();
  expect(said()).toMatch(
    /NOT SENT at Hall B: STOP ALL of Ada, \d\d:\d\d:\d\d\. Press STOP again\./,
  );
  end();
  runners = [A, B, C];
  posted = [];
  await pass(31_000);
  hear();
  expect(heard).toEqual([]);
  expect(posted).toEqual([]); // nor to a runner of which the page hears now
  pageLink.now().live?.stop("all");
  await pass(100);
  expect(heard).toHaveLength(1);
  expect(said()).not.toContain("Ada");
});

test("a STOP ALL of somebody who has left before any runner was known is not sent, and the notice says so", async () => {
  pageLink.leave();
  vi.resetModules();
  ({ pageLink } = await import("./page-link"));
  const answered = fetch;
  let isSilent = true;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    if (isSilent) throw new TypeError("no answer");
    return answered(url, init);
  });
  runners = [A];
  pageLink.enter(ADA, 1);
  pageLink.now().live?.stop("all");
  pageLink.leave();
  await pass(8 * 3_600_000);
  pageLink.enter(BOB, 2);
  expect(said()).toContain("NOT SENT: STOP ALL of Ada");
  isSilent = false;
  await pass(10_000);
  hear();
  expect(posted).toEqual([]);
  expect(said()).toContain("NOT SENT: STOP ALL of Ada");
  pageLink.leave();
  expect(pageLink.now().signedIn).toBe(false); // nothing is sent on
});

test("whoever comes back has the sockets of all again", async () => {
  pageLink.leave();
  const before = Wire.all.length;
  pageLink.enter(BOB, 2);
  expect(Wire.all.length - before).toBe(2); // also before the editor has answered
});

test("an answer that does not say where the runners are takes no way of Stop", async () => {
  hear();
  const answered = fetch;
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) =>
    url.endsWith("/api/config") ? Response.json({}) : answered(url, init),
  );
  await pass(31_000);
  pageLink.now().live?.stop("all");
  expect(posted).toEqual([`${A.url}/api/stop`, `${B.url}/api/stop`]);
});
