import { expect, test } from "vitest";
import type { LiveNow, StopAsked } from "../api/live";
import type { Run } from "../api/runs";
import { noticeOf } from "./stop-notice";

const stop: StopAsked = { id: "s", run: "r", at: 1000, state: "heard", detail: "" };

function now(part: Partial<Run> | null, link: LiveNow["link"] = "live"): LiveNow {
  const run = { id: "r", number: 7, state: "running", ended_at: null, ...part } as Run;
  return { link, since: 0, engines: [], stops: [stop], runs: new Map(part ? [["r", run]] : []) };
}

test("a Stop that nothing proves becomes loud", () => {
  expect(noticeOf(stop, now({ state: "stopping" }), 1500)?.tone).toBe("quiet");
  const later = noticeOf(stop, now({ state: "stopping" }), 9000);
  expect(later?.tone).toBe("loud");
  expect(later?.text).toContain("STOP UNCONFIRMED");
});

test("stopped is said when the run's state says so", () => {
  const ended = now({ state: "stopped", ended_at: "1970-01-01T00:00:02Z" });
  expect(noticeOf(stop, ended, 2500)).toEqual({ tone: "done", text: "Run 7: stopped." });
  expect(noticeOf(stop, ended, 60_000)).toBeNull();
});

test("without the runner nothing is claimed", () => {
  expect(noticeOf(stop, now({}, "down"), 1200)?.text).toContain("UNCONFIRMED");
  const unheard = { ...stop, state: "unheard", detail: "The runner does not answer." } as const;
  expect(noticeOf(unheard, now({}, "down"), 1200)?.text).toContain("did not reach");
});

test("a refused Stop says why", () => {
  expect(noticeOf({ ...stop, state: "refused", detail: "no such run" }, now(null), 1200)).toEqual({
    tone: "loud",
    text: "Stop refused: no such run",
  });
});
