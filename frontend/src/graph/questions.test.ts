import { expect, test } from "vitest";
import { isReadyMade, rolesIn } from "./questions";

test("roles are those of actions that people answer, each once", () => {
  const actions = [
    { name: "AaConfirm", actor: "Nurse" },
    { name: "AaAskPhoto", actor: "Guard" },
    { name: "AaChoose", actor: "Nurse" },
    { name: "AaAskText", actor: "" },
    { name: "AaWait", actor: "Clock" },
    { name: "Drive", actor: "Scout" },
  ];
  expect(rolesIn(actions)).toEqual(["Guard", "Nurse"]);
});

test("a name that only begins like a ready-made one is an action of a robot", () => {
  expect(isReadyMade({ name: "AaWait" })).toBe(true);
  expect(isReadyMade({ name: "AaWaitForLift" })).toBe(false);
});
