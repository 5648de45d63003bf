import { expect, test } from "vitest";
import { type SiteRouter, setSiteRouter, setSites } from "../api/sites";
import { courseOf } from "./course-bar";
import { byDay, comparisonObstacle, type RunOfList, runsBefore } from "./run-list";

const NOW = Date.parse("2026-11-24T12:00:00");
const DAY = 86_400_000;

function run(number: number, graph: string | null, at = NOW, more: Partial<RunOfList> = {}) {
  const requested_at = new Date(at).toISOString();
  return {
    id: `r${number}`,
    number,
    graph,
    graph_name: "walk",
    requested_at,
    ...more,
  } as RunOfList;
}

test("runs stand by the day on which they were asked for, in their order", () => {
  const runs = [run(4, "a"), run(3, "a", NOW - 1000), run(2, "b", NOW - DAY), run(1, "a", 0)];
  const days = byDay(runs, NOW);
  expect(days.map((each) => each.runs.map(({ number }) => number))).toEqual([[4, 3], [2], [1]]);
  expect(days.slice(0, 2).map((each) => each.day)).toEqual(["today", "yesterday"]);
  const late = { started_at: new Date(NOW).toISOString() };
  const over = byDay([run(3, "a"), run(2, "a", NOW - DAY, late), run(1, "a", NOW - DAY)], NOW);
  expect(over.map((each) => [each.key, each.runs.length])).toEqual([
    ["today", 1],
    ["yesterday", 2],
  ]);
});

test("the run before is of the same graph, and none that is hidden", () => {
  const hidden = { hidden: true } as const;
  const runs = [
    run(6, "a"),
    run(5, "b"),
    run(4, "a", NOW, hidden),
    run(3, "a"),
    run(2, null),
    run(1, null),
  ];
  const before = [...runsBefore(runs)].map(([id, each]) => [id, each.number]);
  expect(before).toEqual([
    ["r6", 3],
    ["r2", 1],
  ]);
});

test("a course shows the worst of what ran at a time, and what runs still", () => {
  const at = (s: number) => new Date(s * 1000).toISOString();
  const visit = (from: number, until: number | null, result: string | null) => ({
    from: at(from),
    not_before: at(from),
    until: until === null ? null : at(until),
    not_after: until === null ? null : at(until),
    result,
    how: "observed",
  });
  const visits = [visit(0, 30, "true"), visit(10, 20, "error"), visit(45, null, null)];
  const actions = { Walk_0: { older: 0, visits } } as unknown as NonNullable<RunOfList["actions"]>;
  const shown = courseOf({ actions, ended_at: null }, 0, 60_000);
  expect(shown.map(({ tone, steps }) => [tone, steps])).toEqual([
    ["true", 10],
    ["error", 10],
    ["true", 10],
    ["idle", 15],
    ["run", 15],
  ]);
  expect(courseOf({ actions, ended_at: at(60) }, 0, 60_000).at(-1)?.tone).toBe("unknown");
});

test("a run is compared with runs of its own site only", () => {
  const sites = ["A", "B"].map((name) => ({ name: `Hall ${name}`, url: `http://${name}` }));
  const siteOf = (id: string) => sites[id === "r3" ? 1 : 0];
  setSites(sites);
  setSiteRouter({ siteOfId: siteOf } as SiteRouter);
  const runs = [run(4, "a"), run(3, "a"), run(2, "a")];
  expect([...runsBefore(runs)].map(([later, { id }]) => [later, id])).toEqual([["r4", "r2"]]);
  expect(comparisonObstacle("r3", ["r4"])).toContain("Hall A");
  expect([comparisonObstacle("r2", ["r4"]), comparisonObstacle("r3", [])]).toEqual(["", ""]);
  setSiteRouter(undefined);
  setSites([]);
});
