import { expect, test } from "vitest";
import type { QueueLook } from "../api/queue";
import { turnObstacle } from "./queue-turn";

const look = (overridden: string[], ...items: object[]): QueueLook =>
  ({
    look: "now",
    overridden,
    looks: [{ items: items.map((each) => ({ verdict: "blocked", codes: [], ...each })) }],
  }) as unknown as QueueLook;
const others = { code: "others", overridable: true, codes: ["others"] };

test("an entry starts only as its person has looked at it, with all that keeps it back out of the way", () => {
  expect(turnObstacle(look([]), "now")).toBeNull();
  expect(turnObstacle(look([]), "before")).toBe("Something has changed: look again");
  expect(turnObstacle(look([], { code: "baton" }), "now")).toBe("A check prevents the start");
  expect(turnObstacle(look([], { code: "confirm" }), "now")).toBe("Confirm that it is you first");
});

test("a check that the start overrides does not keep it back, and another one does", () => {
  expect(turnObstacle(look(["others"], others), "now")).toBeNull();
  expect(turnObstacle(look(["quiet"], others), "now")).toBe("A check prevents the start");
});
