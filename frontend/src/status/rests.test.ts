import fc from "fast-check";
import { expect, test } from "vitest";
import { silentRests } from "../api/run-stop";
import type { Run, Visit } from "../api/runs";
import { howWords } from "./progress";
import { askedOutcomes, openRests, type RobotRest, restLines } from "./rests";

const AT = "2026-01-01T12:00:04Z";
const run = (...rests: RobotRest[]) =>
  ({ ended_at: null, desired: "stopped", graph_name: "g", actions: {}, rests }) as unknown as Run;
const wordsOf = (rest: RobotRest, unheard = false) => restLines(run(rest), unheard)[0]?.words;

const BY = { id: "b", name: "Ben", type: "person" as const };
const STATES: RobotRest["state"][] = [
  ...(["unused", "going", "stopping", "silent", "unproven"] as const),
  ...(["proven", "seen", "unsent", "unknown"] as const),
];

test("each robot has its own line, and only an answer is called a proof", () => {
  const lines = restLines(
    run(
      { robot: "Carol", state: "silent", since: AT, stops: true },
      { robot: "David", state: "proven", since: AT },
      { robot: "Eve", state: "stopping", since: AT, stops: true },
    ),
    false,
  );
  expect(lines.map(({ robot }) => robot)).toEqual(["Carol", "David", "Eve"]);
  expect(lines[0]?.words).toMatch(/^silent since .*: not known; the stop is repeated$/);
  expect(lines[1]?.words).toMatch(/^proven at rest at /);
  expect(lines[2]?.words).toBe("rest not proven yet, the stop is repeated");
});

test("what a person has seen is said as seen by that person", () => {
  const words = wordsOf({ robot: "D", state: "seen", since: AT, by: BY, why: "I stand there." });
  expect(words).toContain("Ben");
  expect(words).toMatch(/not proven: I stand there$/);
});

test("words of a person turn no words around them", () => {
  const why = "\u202eI stand there";
  const words = wordsOf({ robot: "D", state: "seen", since: AT, by: BY, why });
  expect(words).toMatch(/not proven: \u2068\u202eI stand there\u2069$/);
  const said = { by: BY, at: AT, reason: why };
  expect(howWords({ said, how: "inferred" } as unknown as Visit)).toBe(
    "said by Ben: \u2068\u202eI stand there\u2069",
  );
});

test("no robot is green, and none is called proven but by a proof, heard or not", () => {
  fc.assert(
    fc.property(fc.constantFrom(...STATES), fc.boolean(), fc.boolean(), (state, stops, unheard) => {
      const [line] = restLines(run({ robot: "D", state, since: AT, stops }), unheard);
      expect(line?.tone).not.toBe("true");
      expect(line?.words.startsWith("proven")).toBe(state === "proven");
      if (unheard && ["going", "stopping", "silent", "unproven", "unknown"].includes(state))
        expect(line?.words).toMatch(/^not known/);
    }),
  );
});

test("a person can be asked only about robots that cannot show their rest", () => {
  const asked = silentRests(run(...STATES.map((state) => ({ robot: state, state }))));
  expect(asked.map(({ state }) => state)).toEqual(["silent", "unproven"]);
});

test("an outcome is asked for while the run goes on, and not after a stop", () => {
  const actions = { A_0: { asks: true }, B_0: {} };
  const held = { ended_at: null, desired: "running", actions } as unknown as Run;
  expect(askedOutcomes(held)).toEqual(["A_0"]);
  expect(askedOutcomes({ ...held, desired: "stopped" })).toEqual([]);
  expect(askedOutcomes({ ...held, ended_at: AT })).toEqual([]);
});

test("rest is confirmed for a piece that may go on, a silent robot first", () => {
  const rest = (robot: string, state: RobotRest["state"], piece: string) => ({
    robot,
    state,
    piece,
  });
  const found = openRests(
    run(
      rest("Carol", "going", "r.2"),
      rest("David", "silent", "r.9"),
      rest("Eve", "proven", "r.3"),
      { robot: "Fay", state: "unused" },
    ),
  );
  expect(found.map(({ piece }) => piece)).toEqual(["r.9", "r.2"]);
});
