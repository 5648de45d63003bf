import fc from "fast-check";
import { expect, test } from "vitest";
import type { Robot } from "../../api/robots";
import { rolesIn } from "../../graph/questions";
import { actionsInside, actorsIn, castObstacle, castOf, movesWords, whyOff } from "./led-choice";

const robot = (name: string, part: object = {}) =>
  ({ name, simulated: false, led: true, state: "answering", ...part }) as Robot;
const simulator = robot("simulator", { simulated: true, led: false });
const umrf = (...actors: string[]) =>
  JSON.stringify({
    graph_name: "g",
    actions: actors.map((actor, i) => ({ name: "Do", instance_id: i, ...(actor && { actor }) })),
  });

test("the actors of a graph come once, and actions that name none come last", () => {
  const actors = umrf("Scout", "", "Carrier", "Scout");
  expect(actorsIn(actors, undefined)).toEqual(["Carrier", "Scout", ""]);
  expect(actorsIn(undefined, undefined)).toEqual([]);
  expect(actorsIn(actors, null)).toEqual([]);
});

test.each([
  ["", ["", ""], [""]],
  ["Scout", ["", ""], ["Scout"]],
  ["Carrier", ["Scout", "Scout"], ["Scout"]],
  ["Carrier", ["Scout", ""], ["Carrier", "Scout"]],
  ["", ["Scout", ""], ["Scout", ""]],
  ["Carrier", [], ["Carrier"]],
])("a graph inside of %j with the actors %j has those of its actions", (around, within, found) => {
  const named = (name: string, ...actors: string[]) => ({
    name,
    umrf: JSON.parse(umrf(...actors)) as Record<string, unknown>,
  });
  const top = umrf(around).replace('"Do"', '"Sub"');
  expect(actorsIn(top, [named("Sub", ...within)])).toEqual(found);
  const deep = { name: "Sub", umrf: umrf("").replace('"Do"', '"Deep"') };
  expect(actorsIn(top, [deep, named("Deep", ...within)])).toEqual(found);
});

test("the questions inside of sub-graphs ask their roles, at each level", () => {
  const asking = (actor: string) => ({ name: "AaConfirm", instance_id: 0, actor });
  const inside = [
    { name: "Pick", umrf: { actions: [asking("Cook"), { name: "Do", instance_id: 0 }] } },
    { name: "Deep", umrf: JSON.stringify({ actions: [asking("Guard")] }) },
  ];
  expect(rolesIn(actionsInside(inside))).toEqual(["Cook", "Guard"]);
  expect(actionsInside(null)).toEqual([]);
});

test("levels that double are read once for each actor, and a graph inside of itself is no circle", () => {
  const sub = (name: string, ...calls: [name: string, actor?: string][]) => ({
    name,
    umrf: {
      actions: calls.map(([called, actor], i) => ({ name: called, instance_id: i, actor })),
    },
  });
  // Thirty levels of two hold a thousand million actions.
  const levels = Array.from({ length: 30 }, (_, i) => sub(`L${i}`, [`L${i + 1}`], [`L${i + 1}`]));
  const top = umrf("Scout").replace('"Do"', '"L0"');
  expect(actorsIn(top, [...levels, sub("L30", ["Do"], ["Do", "Carrier"])])).toEqual([
    "Carrier",
    "Scout",
  ]);
  expect(actorsIn(top, [sub("L0", ["L0"], ["L0"], ["Do", "Carrier"])])).toEqual(["Carrier"]);
});

test("a robot that cannot play says why", () => {
  expect(whyOff(robot("David", { led: false }), true)).toBe("led runs are off");
  expect(whyOff(robot("David"), false)).toBe("operators only");
  expect(whyOff(robot("David", { state: "no_link" }), true)).toBe("no link");
  expect(whyOff(robot("David", { state: "gone" }), true)).toBe("");
  expect(whyOff(simulator, false)).toBe("");
});

test("an actor is played by the robot of its name, by nobody else without a choice", () => {
  const engines = [simulator, robot("Scout"), robot("Carol")];
  expect(castOf(["Carrier", "Scout"], {}, engines, true)).toEqual({ Scout: "Scout" });
  const chosen = { Carrier: "Carol", Scout: "simulator" };
  expect(castOf(["Carrier", "Scout"], chosen, engines, true)).toEqual(chosen);
});

test("where no robot may be led, the simulator plays all", () => {
  const engines = [simulator, robot("Scout", { led: false })];
  expect(castOf(["Scout", ""], {}, engines, true)).toEqual({ Scout: "simulator", "": "simulator" });
});

test("whatever was chosen before, only robots that can play are cast, and gaps are an obstacle", () => {
  const names = fc.constantFrom("Scout", "Carol", "simulator", "gone", "", "constructor");
  fc.assert(
    fc.property(
      fc.uniqueArray(names, { minLength: 1 }),
      fc.dictionary(names, names),
      fc.array(
        fc.record({ name: names, led: fc.boolean(), state: fc.constantFrom("no_link", "gone") }),
      ),
      fc.boolean(),
      (actors, chosen, robots, may) => {
        const engines = [simulator, ...robots.map(({ name, ...part }) => robot(name, part))];
        const cast = castOf(actors, chosen, engines, may);
        for (const name of Object.values(cast))
          expect(engines.some((each) => each.name === name && whyOff(each, may) === "")).toBe(true);
        const whole = actors.every((actor) => Object.hasOwn(cast, actor));
        expect(castObstacle(actors, cast) === null).toBe(whole);
      },
    ),
  );
});

test("words name the actor without a robot, and the robots that may move", () => {
  expect(castObstacle(["Scout"], {})).toContain("Scout");
  expect(castObstacle([""], {})).toBe("Choose who plays all actions");
  expect(castObstacle(["Scout", ""], { Scout: "David" })).toBe(
    "Choose who plays the other actions",
  );
  expect(movesWords({ a: "simulator" })).toBe("Only the simulator plays: nothing moves.");
  const mixed = movesWords({ a: "David", b: "simulator", c: "Carol" });
  expect(mixed).toMatch(/Carol.? and .?David.? may begin to move/);
  expect(mixed).toContain("The simulator plays the others.");
});
