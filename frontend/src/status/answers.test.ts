import { expect, test } from "vitest";
import type { Run } from "../api/runs";
import { answersOf, answerWords } from "./answers";
import { limitWords, movesAfter, numberIn } from "./asked-people";

const by = { id: "p", name: "Ann" };
const said = (at: string, value?: boolean | number | string) => ({
  ...{ question: `q${at}`, by, at },
  ...(value === undefined ? { reason: "It is broken." } : { value }),
});

test("answers stand in the order in which they were given, whatever their action", () => {
  const actions = {
    AaConfirm_0: { visits: [{ answered: said("2026-01-01T10:00:03Z", true) }, {}] },
    AaAskNumber_0: { visits: [{ answered: said("2026-01-01T10:00:01Z", 4.5) }] },
  };
  const found = answersOf({ actions } as unknown as Run);
  expect(found.map(({ action }) => action)).toEqual(["AaAskNumber_0", "AaConfirm_0"]);
});

test("an answer reads as a person gave it, and what could not be answered says why", () => {
  const words = (value?: boolean | number | string) => answerWords(said("", value) as never);
  expect([words(true), words(false), words(4.5), words("left")]).toEqual([
    ...["yes", "no", "4.5", "left"],
  ]);
  expect(words()).toBe("could not answer: It is broken.");
});

const question = (more: object) => ({ text: "Is it open?", ...more }) as never;
const NOW = Date.parse("2026-01-01T10:00:00Z");

test("a question says when it ends without an answer and how, and when it is asked again", () => {
  const ends = question({ deadline: "2026-01-01T10:05:00Z", at_deadline: "false" });
  expect(limitWords(ends, NOW)).toMatch(/^Without an answer it ends false at .*, in 5:00/);
  const lapses = question({ lapses_at: "2026-01-01T10:01:00Z" });
  expect(limitWords(lapses, NOW)).toMatch(/^Asked again at .*, in 1:00/);
  expect(limitWords(question({}), NOW)).toBe("");
});

test("a deadline before the lapse is told alone", () => {
  const both = { deadline: "2026-01-01T10:00:30Z", lapses_at: "2026-01-01T10:01:00Z" };
  expect(limitWords(question({ ...both, at_deadline: "error" }), NOW)).not.toContain("again");
});

test("a number may have a comma, and nothing else is one", () => {
  expect([numberIn("4,5"), numberIn(" -2 "), numberIn("1e3")]).toEqual([4.5, -2, 1000]);
  expect([numberIn(""), numberIn("4 m"), numberIn("1,2,3")]).toEqual([null, null, null]);
});

test("an answer names the robots that may move after it", () => {
  expect(movesAfter(question({ moves: [] }))).toBe("");
  expect(movesAfter(question({ moves: ["David"] }))).toMatch(/David.? may begin to move/);
});
