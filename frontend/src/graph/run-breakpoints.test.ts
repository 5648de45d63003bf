import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "./document-keys";
import { addAction, connect, setExit, setResponse } from "./edit";
import { readGraph } from "./read";
import { placeIn, toggledAt } from "./run-breakpoints";

test("a run's own breakpoints are set and removed by place, and only where a run can wait", () => {
  const doc = new Y.Doc();
  const lift = addAction(doc, { name: "Lift" });
  const scan = addAction(doc, { name: "Scan" });
  const on = connect(doc, lift, scan, "on_true") ?? "";
  const stop = connect(doc, scan, lift, "on_false") ?? "";
  setResponse(doc, stop, "on_false", "stop");
  setExit(doc, scan);
  const graph = () => readGraph(mapsOf(doc));
  expect(placeIn(graph(), lift)).toEqual({ action: "Lift_0", to: "" });
  expect(placeIn(graph(), on)).toEqual({ action: "Lift_0", to: "Scan_0" });
  expect(placeIn(graph(), `${scan}>exit`)).toEqual({ action: "Scan_0", to: "exit" });
  expect(placeIn(graph(), stop)).toBeNull();
  expect(placeIn(graph(), "gone")).toBeNull();
  const arrow = { action: "Lift_0", to: "Scan_0" };
  const before = [{ action: "Lift_0" }, { action: "Lift_0", outcomes: ["error" as const] }];
  const set = toggledAt(before, arrow);
  expect(set).toEqual([...before, arrow]);
  expect(toggledAt(set, { action: "Lift_0", to: "" })).toEqual([arrow]);
  expect(toggledAt(set, arrow)).toEqual(before);
});
