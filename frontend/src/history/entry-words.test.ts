import { expect, test } from "vitest";
import { spokenName } from "../graph/spoken-name";
import { entryLines, lineText, shortened, whenWords } from "./entry-words";

type SittingChanges = Parameters<typeof entryLines>[0];
type Arrow = NonNullable<SittingChanges["relations"]>[number];

const words = (changes: SittingChanges) => entryLines(changes).map(lineText);
const number = (value: number) => JSON.stringify({ pvf_type: "number", pvf_value: value });
const changed = (aid: string, name: string, ...fields: [string, unknown, unknown][]) => ({
  change: "changed" as const,
  aid,
  name,
  fields: fields.map(([field, before, after]) => ({ field, before, after })),
});
const arrow = (change: Arrow["change"], parent: string, child: string): Arrow => ({
  change,
  parent: `${parent}_0`,
  child: `${child}_0`,
  ends: [parent, child],
  fields: [],
  when: [["on_true", "run"]],
});

test("actions that came and went, with the arrows that went along", () => {
  const removed = { change: "removed" as const, aid: "w", name: "WaitForCooling_0", fields: [] };
  const added = { change: "added" as const, aid: "p", name: "WatchPressure_2", fields: [] };
  const relations = [
    arrow("removed", "w", "x"),
    arrow("removed", "y", "w"),
    arrow("added", "Dock", "Charge"),
  ];
  expect(words({ actions: [removed, added], relations })).toEqual([
    "added WatchPressure 2",
    "connected Dock → Charge when true",
    "removed WaitForCooling and its 2 arrows",
  ]);
});

test("values, names and places", () => {
  const changes = {
    actions: [
      changed("c", "CloseValve_0", ["in/torque", number(12.5), number(85)]),
      changed("d", "DriveTo_0", ["name", "Drive_0", "DriveTo_0"], ["position", [0, 0], [1, 1]]),
      changed("e", "Wait_0", ["position", [0, 0], [1, 1]], ["actor", "", "atlas"]),
    ],
  };
  expect(words(changes)).toEqual([
    "set CloseValve torque 12.5 → 85",
    "renamed Drive to DriveTo",
    "set Wait robot atlas",
    "moved 2 cards",
  ]);
});

test("breakpoints are said in words, not by what the document keeps of them", () => {
  const set = changed("d", "DriveTo_0", ["breakpoint", null, "{}"]);
  const other = changed("w", "Wait_1", ["breakpoint", "{}", '{"visit":2}']);
  const between = {
    ...arrow("changed", "Dock", "Charge"),
    fields: [{ field: "breakpoint", before: "{}", after: null }],
  };
  expect(words({ actions: [set, other], relations: [between] })).toEqual([
    "set a breakpoint at DriveTo",
    "removed the breakpoint at Dock → Charge",
    "changed the breakpoint at Wait 1",
  ]);
});

test("what an arrow says of an outcome", () => {
  const fields = [
    { field: "on_true", before: "ignore", after: "run" },
    { field: "on_false", before: "run", after: "ignore" },
    { field: "on_error", before: "run", after: "stop" },
    { field: "waypoints/run", before: null, after: "[]" },
  ];
  expect(words({ relations: [{ ...arrow("changed", "A", "B"), fields }] })).toEqual([
    "connected A → B when true",
    "disconnected A → B when false",
    "set A → B when error run → stop",
    "bent 1 arrow",
  ]);
  expect(
    whenWords([
      ["on_true", "run"],
      ["on_error", "run"],
      ["on_false", "stop"],
    ]),
  ).toBe("when true or error, when false: stop");
});

test("what people wrote", () => {
  const note = {
    change: "added" as const,
    id: "n",
    text: "Steam at the\nnorth side.",
    moved: false,
  };
  const fields = [{ field: "name", before: "task_1", after: "valves" }];
  expect(words({ notes: [note], comments: 1, fields })).toEqual([
    "renamed the graph task_1 → valves",
    "wrote a note “Steam at the north side.”",
    "wrote a comment",
  ]);
  const moved = { ...note, change: "changed" as const, moved: true };
  expect(words({ notes: [moved] })).toEqual(["moved 1 note"]);
});

test("a few are told, of the others how many", () => {
  const actions = Array.from({ length: 9 }, (_, i) =>
    changed(`${i}`, `A_${i}`, ["type", "a", "b"]),
  );
  const { lines, more } = shortened({ actions, more: 2 }, 4);
  expect([lines.length, more]).toEqual([4, 7]);
  expect(shortened({ actions: actions.slice(0, 5) }, 4).more).toBe(0);
});

test("names are said without their number where it is 0", () => {
  expect(["entry", "Drive_0", "Drive_3", "odd", "_0"].map(spokenName)).toEqual([
    "Entry",
    "Drive",
    "Drive 3",
    "odd",
    "an action",
  ]);
});

test("values that were overwritten at once, with what stayed", () => {
  const overwritten = {
    fields: [{ field: "description", before: "mine", after: "theirs" }],
    actions: [
      changed("a", "Look_0", ["description", "by Ada", "by Mari"], ["position", [0, 0], [1, 1]]),
      changed("b", "Grip_0", ["name", "Grasp_0", "Grip_0"], ["in/speed", number(3), number(7)]),
      changed("c", "Lift_0", ["description", "up", ""]),
      { change: "removed" as const, aid: "d", name: "Turn_0", fields: [] },
    ],
    relations: [
      arrow("removed", "Dock", "Charge"),
      {
        ...arrow("changed", "Look", "Grip"),
        fields: [{ field: "on_true", before: "stop", after: "run" }],
        when: [],
      },
    ],
    notes: [{ change: "changed" as const, id: "n", text: "hot steam", moved: false }],
  };
  expect(words({ overwritten })).toEqual([
    "set Look description to by Ada, overwritten at once by by Mari",
    "moved Look, overwritten at once",
    "renamed Grip to Grasp, overwritten at once by Grip",
    "set Grip speed to 3, overwritten at once by 7",
    "set Lift description to up, deleted by somebody else at the same time",
    "added Turn, deleted by somebody else at the same time",
    "connected Dock → Charge, deleted by somebody else at the same time",
    "set Look → Grip when true to stop, overwritten at once by run",
    "set the graph description to mine, overwritten at once by theirs",
    "wrote a note “hot steam”, overwritten at once",
  ]);
  expect(entryLines({ overwritten }).every(({ sign }) => sign === "overwritten")).toBe(true);
});
