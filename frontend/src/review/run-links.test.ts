import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { recordedUrls } from "./run-links";

const RUN = {
  id: "r1",
  engine: "Lift 2/3",
  simulated: false,
  started_at: "2026-11-30T12:00:00.500Z",
  ended_at: "2026-11-30T12:01:00Z",
} as Run;
const URL = "https://nvr.lab/{robot}?from={from}&to={to_ms}&t={at_ms}&run={run}";

test("the address of a recording names robot, run and times, each escaped", () => {
  const at = Date.parse("2026-11-30T12:00:30Z");
  expect(recordedUrls(RUN, URL, at)).toEqual([
    {
      robot: "Lift 2/3",
      href:
        "https://nvr.lab/Lift%202%2F3?from=2026-11-30T12%3A00%3A00.500Z" +
        `&to=${Date.parse("2026-11-30T12:01:00Z")}&t=${at}&run=r1`,
    },
  ]);
});

test("at the end of a run its last moment is shown, and each robot of a led run has an address", () => {
  const led = { ...RUN, engine: "conducted", robots: { "": "A", lift: "B" } } as Run;
  const found = recordedUrls(led, "https://nvr.lab/{robot}/{at}", null);
  expect(found.map(({ href }) => href)).toEqual([
    "https://nvr.lab/A/2026-11-30T12%3A01%3A00.000Z",
    "https://nvr.lab/B/2026-11-30T12%3A01%3A00.000Z",
  ]);
});

test("nothing was recorded of a run in the simulator, or of one that has not begun", () => {
  expect(recordedUrls({ ...RUN, simulated: true }, URL, null)).toEqual([]);
  expect(recordedUrls({ ...RUN, started_at: null }, URL, null)).toEqual([]);
});
