import fc from "fast-check";
import { expect, test } from "vitest";
import { mentionedIn, queryAt, suggestions, withMention } from "./mentions";

const MARI = { id: "m", name: "Mari" };
const MARIA = { id: "ma", name: "Maria Kask" };
const BEN = { id: "b", name: "Ben" };
const OTHER_BEN = { id: "b2", name: "Ben" };
const ALL = [MARI, MARIA, BEN, OTHER_BEN];
const NOBODY: ReadonlySet<string> = new Set();

test("an at sign after a blank asks for a person, up to the caret", () => {
  expect(queryAt("Hello @Ma", 9)).toEqual({ at: 6, search: "Ma" });
  expect(queryAt("@", 1)).toEqual({ at: 0, search: "" });
  expect(queryAt("@Maria Ka", 9)).toEqual({ at: 0, search: "Maria Ka" });
  expect(queryAt("mari@lab.org", 12)).toBeNull();
  expect(queryAt("@Mari ", 6)).toBeNull();
  expect(queryAt("@Mari\nHello", 11)).toBeNull();
});

test("names that begin with what was typed come first", () => {
  expect(suggestions(ALL, "a").map(({ id }) => id)).toEqual(["m", "ma"]);
  expect(suggestions(ALL, "mari").map(({ id }) => id)).toEqual(["m", "ma"]);
  expect(suggestions(ALL, "kask")).toEqual([MARIA]);
});

test("the longest name counts, a part of a word does not", () => {
  expect(mentionedIn("@Maria Kask, look", ALL, NOBODY)).toEqual(["ma"]);
  expect(mentionedIn("@Mari, look", ALL, NOBODY)).toEqual(["m"]);
  expect(mentionedIn("@Maria, look", ALL, NOBODY)).toEqual([]);
  expect(mentionedIn("a@Mari", ALL, NOBODY)).toEqual([]);
  expect(mentionedIn("(@Mari)", ALL, NOBODY)).toEqual(["m"]);
});

test("of two persons with one name the picked one is meant, and without that nobody", () => {
  expect(mentionedIn("@Ben", ALL, NOBODY)).toEqual([]);
  expect(mentionedIn("@Ben", ALL, new Set(["b2"]))).toEqual(["b2"]);
});

test("who is picked is mentioned, whatever stands around", () => {
  fc.assert(
    fc.property(
      fc.string({ maxLength: 20 }),
      fc.constantFrom(...ALL),
      fc.string({ maxLength: 20 }),
      (before, person, after) => {
        const text = `${before} @${after}`;
        const query = { at: before.length + 1, search: "" };
        const made = withMention(text, query, person.name);
        expect(made.text.slice(0, made.caret)).toMatch(/^[\s\S]*@[\s\S]+$/);
        expect(mentionedIn(made.text, ALL, new Set([person.id]))).toContain(person.id);
      },
    ),
  );
});
