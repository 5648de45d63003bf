import { expect, test } from "vitest";
import type { GraphSummary } from "../api/graphs";
import type { Run } from "../api/runs";
import { allLabels, type GraphOrder, lastRuns, selectGraphs } from "./graph-selection";

const graph = (id: string, more: Partial<GraphSummary> = {}): GraphSummary => ({
  id,
  name: id,
  description: "",
  seq: 1,
  updated_at: `2026-01-0${id.length}T00:00:00Z`,
  made_at: "2026-01-01T00:00:00Z",
  ...more,
});

const run = (of: string, number: number, state: Run["state"] = "finished") =>
  ({ graph: of, number, state, requested_at: `2026-02-0${number}T00:00:00Z` }) as Run;

const graphs = [
  graph("a", { robots: ["rover"], labels: ["night"], actions: 2 }),
  graph("bb", { problems: { error: 1, warning: 0 }, people: [{ id: "1", name: "Mari" }] }),
  graph("ccc", { labels: ["night", "demo"], problems: { error: 0, warning: 9 }, actions: 5 }),
];
const runs = lastRuns([run("a", 1), run("bb", 2), run("a", 3, "stopped")]);
const ids = (order: GraphOrder, search = "", label: string | null = null) =>
  selectGraphs(graphs, { search, label, order }, runs).map(({ id }) => id);

test("the newest run of each graph is its last", () => {
  expect(runs.get("a")?.number).toBe(3);
});

test.each([
  ["changed", ["ccc", "bb", "a"]],
  ["run", ["a", "bb", "ccc"]],
  ["name", ["a", "bb", "ccc"]],
  ["problems", ["bb", "ccc", "a"]],
  ["size", ["ccc", "a", "bb"]],
] as const)("sorted by %s", (order, wanted) => {
  expect(ids(order)).toEqual(wanted);
});

test("of two graphs that which has more wrong has more problems, then that with more to fill in", () => {
  const few = graph("few", { wrong: 1, to_fill_in: 0, problems: { error: 1, warning: 0 } });
  const many = graph("many", { wrong: 0, to_fill_in: 9, problems: { error: 30, warning: 0 } });
  const some = graph("some", { wrong: 0, to_fill_in: 2, problems: { error: 40, warning: 0 } });
  const wish = { search: "", label: null, order: "problems" } as const;
  const found = selectGraphs([some, many, few], wish, runs);
  expect(found.map(({ id }) => id)).toEqual(["few", "many", "some"]);
});

test("a search finds robots, labels and people, and a label is had by all that are shown", () => {
  expect(ids("name", "rover")).toEqual(["a"]);
  expect(ids("name", "mari bb")).toEqual(["bb"]);
  expect(ids("name", "", "night")).toEqual(["a", "ccc"]);
  expect(ids("name", "nothing")).toEqual([]);
  expect(allLabels(graphs)).toEqual(["demo", "night"]);
});
