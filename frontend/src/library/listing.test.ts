import { expect, test } from "vitest";
import type { LibraryAction } from "../api/library";
import { knowledgeOf } from "../home/robot-actions";
import { addressOf, foundActions, listedActions } from "./listing";

const parameter = (path: string) => ({
  path,
  pvf_type: "number",
  required: true,
  text: '{"pvf_type":"number"}',
});
const action = (name: string, more: Partial<LibraryAction> = {}): LibraryAction => ({
  name,
  description: "",
  type: "sync",
  inputs: [],
  outputs: [],
  used_in: [],
  first_seen: "2026-01-01T00:00:00Z",
  document: null,
  seq: null,
  labels: [],
  differs_in: [],
  ...more,
});

const knowledge = knowledgeOf([
  {
    robot: "atlas",
    indexed: { actions: [{ name: "Grip", inputs: {}, outputs: {} }], graphs: [], unread: 0 },
  },
]);
const all = listedActions(
  [
    action("CloseValve", {
      document: "d1",
      inputs: [parameter("pose/x"), parameter("pose/y"), parameter("torque")],
      labels: ["night"],
    }),
    action("Wait", { description: "does nothing" }),
  ],
  knowledge,
);
const namesOf = (list: typeof all) => list.map(({ name }) => name);

test("the list joins library, graphs and robots, and a pose is one parameter in it", () => {
  expect(namesOf(all)).toEqual(["CloseValve", "Grip", "Wait"]);
  expect(all[0]?.summary).toBe("pose, torque");
});

test("filters select by origin", () => {
  expect(namesOf(foundActions(all, "library", ""))).toEqual(["CloseValve"]);
  expect(namesOf(foundActions(all, "graphs", ""))).toEqual(["Wait"]);
  expect(namesOf(foundActions(all, "robot:atlas", ""))).toEqual(["Grip"]);
});

test("the search finds names, descriptions, parameters and labels", () => {
  expect(namesOf(foundActions(all, "all", "torque night"))).toEqual(["CloseValve"]);
  expect(namesOf(foundActions(all, "all", "NOTHING"))).toEqual(["Wait"]);
  expect(foundActions(all, "all", "torque nothing")).toEqual([]);
});

test("every action has an address", () => {
  expect(all.map(addressOf)).toEqual(["/actions/d1", "/actions?name=Grip", "/actions?name=Wait"]);
});

test("a thousand actions are searched within a moment", () => {
  const many = Array.from({ length: 1000 }, (_, i) =>
    action(`Action${i}`, { description: "moves something from here to there".repeat(4) }),
  );
  const list = listedActions(many, knowledge);
  const start = performance.now();
  expect(foundActions(list, "all", "action99 there")).toHaveLength(11);
  expect(performance.now() - start).toBeLessThan(50);
});
