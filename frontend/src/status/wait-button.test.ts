import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { canWait } from "./wait-button";

const run = (part: object = {}) =>
  ({
    ...{ desired: "running", ended_at: null, held: null, simulated: false },
    ...{ robots: { Scout: "David" } },
    ...part,
  }) as unknown as Run;

test("a run that is led and goes on can wait", () => {
  expect(canWait(run())).toBe(true);
  expect(canWait(run({ simulated: true, robots: { "": "simulator" } }))).toBe(true);
});

test("a run that waits, is stopped, is over, or was handed over whole cannot", () => {
  const parts = [
    { held: { by: null, why: "", since: "2026-01-01" } },
    { desired: "stopped" },
    { ended_at: "2026-01-01" },
    { robots: null },
  ];
  for (const part of parts) expect(canWait(run(part))).toBe(false);
});
