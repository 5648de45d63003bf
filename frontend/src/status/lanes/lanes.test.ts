import { expect, test } from "vitest";
import type { Run } from "../../api/runs";
import { fromUmrf } from "../../canvas/from-umrf";
import { lanesOf } from "./lanes";

test("lanes of a led run are the robots' that carry them out, and the actors' without one", () => {
  const names = ["Drive", "Look", "Ring"];
  const actors = ["Carrier", "Scout", "Bell"];
  const actions = names.map((name, i) => ({ name, instance_id: 0, actor: actors[i] }));
  const state = (robot: string) => ({ aid: null, state: "RUNNING", robot, visits: [] });
  const run = {
    graph_name: "g",
    robots: { Carrier: "Carol", Scout: "David", Bell: "simulator" },
    actions: { Drive_0: state("Carol"), Look_0: state("David"), Ring_0: state("") },
  } as unknown as Run;
  const lanes = lanesOf(run, fromUmrf({ graph_name: "g", actions }));
  expect(lanes.map(({ name, robot }) => [name, robot])).toEqual([
    ["Drive_0", "Carol"],
    ["Look_0", "David"],
    ["Ring_0", "Bell"],
  ]);
});
