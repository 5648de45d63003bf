import { expect, test } from "vitest";
import type { LiveState, StopRequest } from "../../api/live-socket";
import { headOf, noticeKey, noticeOf, noticeOfSites, withOwnStops } from "./stop-notice";

test("one notice says of each site what it has to, the loudest first, and names it", () => {
  const joined = noticeOfSites([
    { name: "Hall A", notice: { tone: "done", text: "Run 1: stopped." } },
    {
      name: "Hall B",
      notice: { tone: "loud", stays: true, text: "NOT SENT: use the hardware stop." },
    },
    { name: "Hall C", notice: null },
  ]);
  expect(joined).toEqual({
    tone: "loud",
    stays: true,
    text: "NOT SENT at Hall B: use the hardware stop. Hall A: Run 1: stopped.",
  });
  expect(joined && headOf(joined)).toBe("NOT SENT at Hall B");
  expect(noticeOfSites([{ name: "Hall A", notice: null }])).toBeNull();
});

test("a notice that was put aside comes again with what another site has to say", () => {
  const loud = (text: string) => ({ tone: "loud", stays: true, text }) as const;
  const ofA = { name: "Hall A", notice: loud("STOP UNCONFIRMED: run 1 on Carl: no proof.") };
  const shown = [
    null,
    loud("STOP UNCONFIRMED: patrol on Dora: no proof."),
    loud("STOP MAY REACH NOBODY: The runner does not answer."),
  ].map((notice) => noticeOfSites([ofA, { name: "Hall B", notice }]));
  const keys = shown.map((notice) => notice && noticeKey(notice));
  expect(new Set(keys).size).toBe(3);
  expect(shown[2] && headOf(shown[2])).toBe(
    "STOP UNCONFIRMED at Hall A · STOP MAY REACH NOBODY at Hall B",
  );
});

const stop = (state: StopRequest["state"], run = "all"): StopRequest => ({
  ...{ id: "s", run, at: 0, runs: [], state, detail: "There is no such run." },
});
const site = (link: LiveState["link"], ...stops: StopRequest[]): LiveState => ({
  ...{ link, since: 0, engines: [], runs: new Map(), stops, asked: [] },
});

test("a site that has said nothing yet is not said to run nothing", () => {
  const said = (at: number) => noticeOf(stop("heard"), site("connecting"), at);
  expect(said(500)).toMatchObject({ tone: "quiet", text: "Stop sent" });
  expect(said(4_000)).toMatchObject({ tone: "loud" });
  expect(noticeOf(stop("heard"), site("live"), 500)?.text).toMatch(/nothing runs/);
});

test("a site that does not have the run refuses no Stop that another one takes", () => {
  const named = (state: LiveState, name: string) => ({ site: { name, url: name }, state });
  const stopsAt = (a: StopRequest, b: StopRequest) => {
    const sites = [named(site("live", a), "A"), named(site("live", b), "B")];
    return sites.map(({ state }) => withOwnStops(state, sites).stops.length);
  };
  expect(stopsAt(stop("refused", "r"), stop("heard", "r"))).toEqual([0, 1]);
  expect(stopsAt(stop("refused", "r"), stop("refused", "r"))).toEqual([1, 1]);
  expect(stopsAt(stop("refused"), stop("heard"))).toEqual([1, 1]); // all: it is refused there
});
