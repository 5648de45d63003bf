import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { runStatus } from "./run-status";

const run = (part: Partial<Run>) => ({ ended_at: null, ...part }) as Run;
const SINCE = Date.parse("2026-11-26T12:00:00Z");
const DOWN = { link: "down", since: SINCE } as const;

test.each(["requested", "published", "running", "paused", "stopping"] as const)(
  "a run that was %s is unknown while the runner is not heard",
  (state) => {
    const going = run({ state });
    expect(runStatus(going, { link: "live", since: SINCE }).tone).not.toBe("unknown");
    expect(runStatus(going, DOWN).tone).toBe("unknown");
    expect(runStatus(going, DOWN).word).toMatch(/^unknown since \d/);
  },
);

test("what has ended stays as it ended, whoever is heard", () => {
  const ended = run({ state: "stopped", ended_at: "2026-11-26T11:59:00Z" });
  expect(runStatus(ended, DOWN)).toEqual({ tone: "stopped", word: "stopped" });
});
