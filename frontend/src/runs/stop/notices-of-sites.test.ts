import { expect, test } from "vitest";
import type { LiveState, SiteState, StopRequest } from "../../api/live-socket";
import type { Run } from "../../api/runs";
import { plain } from "../../testing/texts";
import { headOf, noticeKey, noticeOf, wholeNotice } from "./stop-notice";

const NONE: ReadonlySet<string> = new Set();

const stop = (state: StopRequest["state"], run = "all", more: object = {}): StopRequest => ({
  ...{ id: "s", run, at: 0, runs: [], state, detail: "A fault." },
  ...more,
});
const live = (link: LiveState["link"], ...stops: StopRequest[]): LiveState => ({
  ...{ link, since: 0, engines: [], runs: new Map(), stops, asked: [] },
});
const withRun = (state: LiveState, part: object): LiveState => {
  const run = { id: "r", number: 1, state: "running", ended_at: null, alarms: [], engine: "Carl" };
  return { ...state, runs: new Map([["r", { ...run, ...part } as unknown as Run]]) };
};
const named = (name: string, state: LiveState): SiteState => ({ site: { name, url: name }, state });
const whole = (sites: readonly SiteState[], at = 2_000) =>
  wholeNotice({ ...live("live"), sites }, NONE, at);

const ENDED = { state: "stopped", ended_at: "1970-01-01T00:00:01Z" };
const UNCONFIRMED = { desired: "stopped", unconfirmed: "no proof" };

test("one notice says of each site what it has to, the loudest first, and names it", () => {
  const a = withRun(live("live", stop("heard", "r", { provenAt: 1_000 })), ENDED);
  const joined = whole([
    named("Hall A", a),
    named("Hall B", live("live", stop("unheard"))),
    named("Hall C", live("live")),
  ]);
  expect(joined).toMatchObject({ tone: "loud", stays: true });
  expect(plain(joined?.text)).toBe(
    "NOT SENT at Hall B: use the hardware stop. A fault. Trying again. Hall A: Run 1: stopped.",
  );
  expect(plain(joined ? headOf(joined) : "")).toBe("NOT SENT at Hall B");
  expect(whole([named("Hall A", live("live"))])).toBeNull();
});

test("a notice that was put aside comes again with what another site has to say", () => {
  const a = named("Hall A", withRun(live("live"), UNCONFIRMED));
  const others = [
    live("live"),
    withRun(live("live"), { ...UNCONFIRMED, number: 2 }),
    { ...live("down"), unreached: { kind: "silent", why: "Nobody answers." } } as const,
  ];
  const shown = others.map((state) => whole([a, named("Hall B", state)], 9_000));
  const keys = shown.map((notice) => notice && noticeKey(notice));
  expect(new Set(keys).size).toBe(3);
  expect(plain(shown[2] ? headOf(shown[2]) : "")).toBe(
    "STOP UNCONFIRMED at Hall A · STOP MAY REACH NOBODY at Hall B",
  );
});

test("each of several Stops that are not dealt with at one site names it, also in the headline", () => {
  const unsent = stop("unheard", "q", { id: "u" });
  const b = withRun(live("live", unsent, stop("heard", "r")), { number: 2 });
  const notice = whole([named("Hall A", live("live")), named("Hall B", b)], 9_000);
  expect(plain(notice?.text)).toMatch(/STOP UNCONFIRMED at Hall B: run 2 .*NOT SENT at Hall B: /);
  expect(plain(notice ? headOf(notice) : "")).toBe(
    "STOP UNCONFIRMED at Hall B · NOT SENT at Hall B",
  );
});

test("a site that has said nothing yet is not said to run nothing", () => {
  const said = (at: number) => noticeOf(stop("heard"), live("connecting"), at);
  expect(said(500)).toMatchObject({ tone: "quiet", text: "Stop sent" });
  expect(said(4_000)).toMatchObject({ tone: "loud" });
  expect(noticeOf(stop("heard"), live("live"), 500)?.text).toMatch(/nothing runs/);
});

/** Which of two sites are said to refuse the same Stop. */
function refusing(a: StopRequest, b: StopRequest): string[] {
  const sites = [named("A", live("live", a)), named("B", live("live", b))];
  const said = plain(whole(sites)?.text);
  return ["A", "B"].filter((name) => said.includes(`Stop refused at ${name}:`));
}

test("a site that does not have the run refuses no Stop that another one takes", () => {
  const absent = stop("refused", "r", { isAbsent: true });
  expect(refusing(absent, stop("heard", "r"))).toEqual([]);
  expect(refusing(absent, stop("unheard", "r"))).toEqual([]);
  expect(refusing(absent, absent)).toEqual(["A", "B"]);
  expect(refusing(stop("refused"), stop("heard"))).toEqual(["A"]); // all: it is refused there
});

test("a site that may have the run and refuses its Stop says so while another one is silent", () => {
  expect(refusing(stop("refused", "r"), stop("unheard", "r"))).toEqual(["A"]);
  expect(refusing(stop("refused", "r"), stop("heard", "r"))).toEqual([]);
});
