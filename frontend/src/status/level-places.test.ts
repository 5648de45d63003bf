/** Each fact of a run belongs to one place of its levels: vectors that the runner reads, too. */
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import fc from "fast-check";
import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { factOf, placesIn, spokenIn } from "./level-places";

interface Vector {
  why: string;
  graph: string;
  own: string[];
  names: string[];
  places: Record<string, [string[], string, boolean]>;
}
const file = new URL("../../../tests/vectors/levels.json", import.meta.url);
const vectors = JSON.parse(readFileSync(fileURLToPath(file), "utf8")) as Vector[];

test.each(vectors)("places are as the vectors say: $why", ({ graph, own, names, places }) => {
  const found = placesIn(graph, new Set(own), names);
  const told = [...found].map(([key, { levels, name, known }]) => [key, [levels, name, known]]);
  expect(Object.fromEntries(told)).toEqual(places);
});

/** Marks of levels and digits are parts of names. */
const name = fc.constantFrom(
  "Grip",
  "Grip_2",
  "A__B",
  "A__0",
  "A__B__0",
  "0",
  "_",
  "__",
  "A_",
  "é ›",
);
const action = fc.tuple(name, fc.nat(2)).map(([each, number]) => `${each}_${number}`);
const way = fc.array(action, { minLength: 1, maxLength: 4 });

test("whatever runs inside is placed where it runs, and nothing is lost", () => {
  fc.assert(
    fc.property(name, fc.array(way, { minLength: 1, maxLength: 8 }), (graph, ways) => {
      const all = ways.flatMap((each) => each.map((_, depth) => each.slice(0, depth + 1)));
      const byFact = new Map<string, Set<string>>();
      const byPart = new Map<string, Set<string>>();
      const put = (map: Map<string, Set<string>>, key: string, to: readonly string[]) =>
        map.set(key, (map.get(key) ?? new Set()).add(JSON.stringify(to)));
      for (const each of all) {
        const fact = factOf(graph, each);
        put(byFact, fact, each);
        if (each.length > 1) put(byPart, fact.slice(0, fact.lastIndexOf("/")), each.slice(0, -1));
      }
      // An engine has one name for two places, and so one graph: whose it is, nobody can tell.
      fc.pre([...byPart.values()].every((ambiguous) => ambiguous.size === 1));
      const own = new Set(all.flatMap((each) => (each.length === 1 ? (each[0] ?? []) : [])));
      const found = placesIn(graph, own, byFact.keys());
      expect(new Set(found.keys())).toEqual(new Set(byFact.keys()));
      for (const [fact, ways] of byFact) {
        const place = found.get(fact);
        expect(ways).toContain(JSON.stringify([...(place?.levels ?? []), place?.name]));
        expect(place?.known).toBe(true);
      }
    }),
  );
});

test("texts of the runner call the actions of their run as cards do, and leave all else", () => {
  const actions = {
    Fetch_0: { aid: "f" },
    Lift_1: { aid: "l" },
    "round__Fetch__0/Lift_1": { aid: null },
  };
  const run = { graph_name: "round", actions } as unknown as Run;
  const said = (text: string) => spokenIn(run, text);
  expect(said("Breakpoint after Fetch_0.")).toBe("Breakpoint after Fetch.");
  expect(said("It went over round__Fetch__0/Lift_1: Lift_1 waits (Fetch_0)")).toBe(
    "It went over Fetch › Lift 1: Lift 1 waits (Fetch)",
  );
  const inside = { Close_0: { aid: null, levels: ["Grip_0"] } };
  const opened = { ...run, actions: inside } as unknown as Run;
  expect(spokenIn(opened, "It went over Grip_0: Close_0 waits.")).toBe(
    "It went over Grip: Grip › Close waits.",
  );
  expect(said("Grip_0 of task_1 on robot_2")).toBe("Grip_0 of task_1 on robot_2");
});
