import { expect, test } from "vitest";
import { onePerId } from "../../people/people";
import type { Participant } from "../../sync/presence/presence";
import { candidates } from "./quick-add";
import { dragged, selectionAfter } from "./use-canvas-elements";

const select = (id: string, selected: boolean) => ({ type: "select" as const, id, selected });

test("the arrows of one relation are selected together", () => {
  const first = selectionAfter(new Set(["a"]), [select("a", false), select("a>b|on_true", true)]);
  expect([...first]).toEqual(["a>b"]);
  const again = selectionAfter(first, [select("a>b|on_true", false), select("a>b|on_false", true)]);
  expect([...again]).toEqual(["a>b"]);
});

test("an unchanged selection is the identical object", () => {
  const before = new Set(["a"]);
  expect(selectionAfter(before, [select("a", true)])).toBe(before);
});

const person = (
  client: number,
  id: string,
  drag?: Participant["presence"]["drag"],
): Participant => ({
  client,
  id,
  name: id,
  color: "",
  presence: { selection: [], ...(drag ? { drag } : {}) },
});

test("drags of others move their elements, and one's own drag wins", () => {
  const rest = new Map([
    ["a", [0, 0]],
    ["b", [10, 10]],
  ] as [string, [number, number]][]);
  const people = [person(1, "p", { ids: ["a", "gone"], dx: 5, dy: 6 })];
  expect(dragged(rest, people, null).get("a")).toEqual([5, 6]);
  expect(dragged(rest, people, new Map([["a", [1, 1]]])).get("a")).toEqual([1, 1]);
  expect(dragged(rest, [], null)).toBe(rest);
});

test("a person with two windows has one face", () => {
  expect(onePerId([person(1, "p"), person(2, "p"), person(3, "q")]).map(({ id }) => id)).toEqual([
    "p",
    "q",
  ]);
});

test("the search offers matches, best first, and a new action of that name", () => {
  const known = [{ name: "PreDrive" }, { name: "DriveTo" }, { name: "Say" }];
  expect(candidates(known, "drive").map(({ name }) => name)).toEqual([
    "DriveTo",
    "PreDrive",
    "drive",
  ]);
  expect(candidates(known, "DRIVETO").map(({ name }) => name)).toEqual(["DriveTo"]);
  expect(candidates(known, "").length).toBe(3);
});

test("graphs come after the new action, unless the text is their exact name", () => {
  const known = [{ name: "fetch_tool", ofGraph: true } as const, { name: "FetchBox" }];
  expect(candidates(known, "Fetch").map(({ name }) => name)).toEqual([
    "FetchBox",
    "Fetch",
    "fetch_tool",
  ]);
  expect(candidates(known, "fetch_tool").map(({ name }) => name)).toEqual(["fetch_tool"]);
});
