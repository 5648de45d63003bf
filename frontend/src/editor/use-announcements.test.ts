import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import type { Progress } from "../status/progress";
import { progressByAid } from "../status/progress";
import { runAnnouncement } from "./use-announcements";

const graph = fromUmrf({
  graph_name: "g",
  graph_entry: [{ name: "Wait" }],
  graph_exit: [{ name: "Wait" }],
  actions: [{ name: "Wait", instance_id: 0, type: "sync" }],
});
const empty = fromUmrf({ graph_name: "g", graph_entry: [], graph_exit: [], actions: [] });
const [wait] = graph.actions;

test("an action that is not in the graph is announced by its name in the run", () => {
  const run = {
    state: "running",
    ended_at: null,
    actions: { Wait_0: { aid: "gone", state: "FINISHED", visits: [], older: 0, messages: [] } },
  } as unknown as Run;
  const progress = progressByAid(run, false).get("gone") as Progress;
  expect(runAnnouncement(graph, "gone", progress)).toBe("Wait_0: finished");
  expect(runAnnouncement(empty, "gone", progress)).toBe("Wait_0: finished");
  expect(runAnnouncement(graph, wait?.key ?? "", progress)).toBe("Wait: finished");
});
