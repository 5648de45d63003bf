import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { graphsWanted, lastRuns, matchesSearch } from "./graph-selection";

const run = (of: string, number: number, state: Run["state"] = "finished") =>
  ({
    graph: of,
    number,
    state,
    requested_at: `2026-02-0${number}T00:00:00Z`,
    ended_at: state === "running" ? null : "2026-02-09T00:00:00Z",
  }) as Run;

const runs = lastRuns([run("a", 1), run("c", 1, "running"), run("bb", 2), run("a", 3, "stopped")]);
const all = { search: "", label: null, order: "changed" } as const;

test("the newest run of each graph is its last", () => {
  expect(runs.get("a")?.number).toBe(3);
});

test("the server is asked for the order; for that of runs it is told which graphs come first", () => {
  expect(graphsWanted({ ...all, order: "size" }, null, runs)).toMatchObject({ sort: "size" });
  const byRun = graphsWanted({ ...all, order: "run" }, null, runs);
  expect(byRun.first).toEqual(["c", "a", "bb"]);
  expect(byRun.sort).toBeUndefined();
});

test("a folder has its own graphs; a search and a label find those in folders inside, too", () => {
  expect(graphsWanted(all, null, runs)).toMatchObject({ folder: "", deep: false });
  expect(graphsWanted(all, "lab", runs)).toMatchObject({ folder: "lab", deep: false });
  expect(graphsWanted({ ...all, search: " " }, "lab", runs)).toMatchObject({ deep: false });
  expect(graphsWanted({ ...all, search: "x" }, "lab", runs)).toMatchObject({ deep: true });
  expect(graphsWanted({ ...all, label: "night" }, null, runs)).toMatchObject({ deep: true });
});

test("every word of a search stands somewhere", () => {
  expect(matchesSearch("Pick up", "pick_part", "puts it UP")).toBe(true);
  expect(matchesSearch("pick down", "pick_part", undefined)).toBe(false);
});
