import { expect, test } from "vitest";
import { isUrgentChange, withKeptParts } from "./live-messages";
import type { Run } from "./runs";

const action = (state: string) => ({ aid: "a", state, visits: [], older: 0, messages: [] });
const run = (part: Partial<Run>): Run =>
  ({ id: "r", state: "running", alarms: [], ended_at: null, actions: {}, ...part }) as Run;
const parsed = (told: Run): Run => JSON.parse(JSON.stringify(told)) as Run;

test("of a run that is told anew only what changed is another object", () => {
  const before = run({ actions: { A_0: action("FINISHED"), B_0: action("RUNNING") } });
  const now = withKeptParts(
    before,
    run({ actions: { A_0: action("FINISHED"), B_0: action("FINISHED") } }),
  );
  expect(now.actions?.A_0).toBe(before.actions?.A_0);
  expect(now.actions?.B_0?.state).toBe("FINISHED");
  const later = withKeptParts(before, parsed(run({ ...before, state: "stopping" })));
  expect(later.actions).toBe(before.actions);
  expect(later.state).toBe("stopping");
  expect(withKeptParts(before, parsed(before))).toBe(before);
});

test("how the run stands is told at once, what its actions do may wait for the next drawing", () => {
  const before = run({ actions: { A_0: action("RUNNING") } });
  expect(isUrgentChange(before, run({ actions: { A_0: action("FINISHED") } }))).toBe(false);
  expect(isUrgentChange(undefined, before)).toBe(true);
  expect(isUrgentChange(before, run({ state: "unknown" }))).toBe(true);
  expect(isUrgentChange(before, run({ ended_at: "t" }))).toBe(true);
  expect(isUrgentChange(before, run({ alarms: [{} as Run["alarms"][number]] }))).toBe(true);
});
