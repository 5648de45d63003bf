import { expect, test } from "vitest";
import type { Version } from "../api/graphs";
import type { ListedRun } from "../api/review";
import { listedVersions, runsWords } from "./version-row";

const HEARD = { link: "live", since: 0 } as const;
const version = (id: string) => ({ id }) as Version;
const run = (number: number, of: string | null, result: string | null = "on_true") =>
  ({ number, version: of, state: "finished", result }) as ListedRun;

test("each version has its number and its own runs, the newest first", () => {
  const runs = [run(9, "b"), run(8, null), run(7, "a"), run(6, "b")];
  const listed = listedVersions([version("b"), version("a")], runs);
  expect(listed.map(({ number, runs: its }) => [number, its.map((each) => each.number)])).toEqual([
    ["v2", [9, 6]],
    ["v1", [7]],
  ]);
});

test("runs are counted by how they ended", () => {
  expect(runsWords([], HEARD)).toBe("No run yet");
  expect(runsWords([run(1, "a")], HEARD)).toBe("1 run: 1 finished");
  expect(runsWords([run(3, "a", "on_error"), run(2, "a"), run(1, "a")], HEARD)).toMatch(
    /^3 runs: 2 .*, 1 finished: error$/,
  );
  const going = { ...run(2, "a", null), state: "running", ended_at: null } as ListedRun;
  const ended = { ...run(1, "a"), ended_at: "2026-11-26T12:00:00Z" };
  expect(runsWords([going, ended], HEARD)).toBe("2 runs: 1 running, 1 finished");
  expect(runsWords([going, ended], { link: "down", since: Date.now() })).toMatch(
    /^2 runs: 1 unknown since [\d:]+, 1 finished$/,
  );
});
