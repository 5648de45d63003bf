/** Events of a run are listed in an order in which they can have happened. */

import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { plain } from "../testing/texts";
import { markText } from "./replay-controls";
import { eventLines } from "./run-events";

/** An action that the engine says to have begun and ended at these times. */
function ran(from: string, until: string): Run {
  return {
    id: "r",
    number: 1,
    graph: null,
    graph_name: "patrol",
    version: null,
    digest: "",
    engine: "simulator",
    simulated: true,
    state: "finished",
    desired: "running",
    proof_at: null,
    unknown_since: null,
    unconfirmed: null,
    at_rest: null,
    took: null,
    moves_again_at: null,
    result: "on_true",
    requested_at: "2026-11-20T09:00:00.500Z",
    started_at: "2026-11-20T09:00:01.000Z",
    ended_at: "2026-11-20T09:00:03.000Z",
    author: { id: "p1", name: "Ada" },
    stopped_by: null,
    detail: "",
    alarms: [],
    group: null,
    recorded: true,
    robots: null,
    held: null,
    actions: {
      Look_0: {
        aid: "a",
        state: "FINISHED",
        visits: [
          {
            from,
            not_before: from,
            until,
            not_after: until,
            result: "true",
            how: "observed",
            inputs: null,
          },
        ],
        older: 0,
        messages: [],
      },
    },
  };
}

test("nothing comes before the start, although the engine's clock stands behind", () => {
  const told = eventLines(ran("2026-11-20T09:00:00.990Z", "2026-11-20T09:00:02.000Z"), "v1");
  expect(told.map(({ name, text }) => [name, text])).toEqual([
    [null, "Ada started v1 in the simulator"],
    ["Look", "runs"],
    ["Look", "true"],
    [null, "Run finished"],
  ]);
});

test("an end that was seen between two moments is told between them", () => {
  const run = ran("2026-11-20T09:00:01.000Z", "2026-11-20T09:00:02.000Z");
  const [look] = Object.values(run.actions ?? {});
  const visit = look?.visits[0];
  if (visit === undefined) throw new Error("no visit");
  visit.not_after = "2026-11-20T09:00:02.900Z";
  expect(eventLines(run, "v1").map(({ text }) => text)).toContain("true (not before +1.0)");
  visit.not_after = null;
  expect(eventLines(run, "v1").map(({ text }) => text)).toContain(
    "true (not before +1.0); its code may go on",
  );
});

test("what held a run, and who let it go on, stand among its events", () => {
  const run = ran("2026-11-20T09:00:01.000Z", "2026-11-20T09:00:02.000Z");
  const marks = [
    { kind: "run.held.v1", at: "2026-11-20T09:00:02.100Z", text: "Breakpoint before Grip_0." },
    {
      kind: "run.released.v1",
      at: "2026-11-20T09:00:02.500Z",
      by: "Ben",
      text: "one step, Grip_0",
    },
    { kind: "run.stop_sent.v1", at: "2026-11-20T09:00:02.600Z", text: "attempt 1" },
  ].map((mark, seq) => ({ seq, ...mark }));
  const told = eventLines(run, "v1", marks).map(({ text }) => text);
  expect(told).toContain("Nothing further begins: Breakpoint before Grip_0.");
  expect(told).toContain("Ben let it go on: one step, Grip_0");
  expect(told).not.toContain("Stop message: attempt 1");
});

test.each([
  ["lapsed", "The question closed without an answer and is asked again"],
  ["held", "The question closed without an answer, since the run waits; it is asked again"],
  ["deadline", "The question closed without an answer: nobody answered in time"],
  ["restarted", "The question closed without an answer: the runner was restarted"],
  ["stopped", "The question closed without an answer: the run or its action was stopped"],
  ["of a later version", "The question closed without an answer: of a later version"],
])("a question that closed since it was %s says so", (why, words) => {
  expect(markText({ kind: "run.question_closed.v1", by: "", text: why })).toBe(words);
});

test("the first line names where a run was started, and a run that only asks people has no robot", () => {
  const run = ran("2026-11-20T09:00:01.100Z", "2026-11-20T09:00:02.000Z");
  const first = (more: Partial<Run>) => plain(eventLines({ ...run, ...more }, "v1")[0]?.text);
  expect(first({})).toBe("Ada started v1 in the simulator");
  expect(first({ engine: "David", simulated: false })).toBe("Ada started v1 on David");
  expect(first({ robots: {} })).toBe("Ada started v1, which only asks people");
});
