import { expect, test } from "vitest";
import { linkTo, linkToProblem, pastOf, targetOf, withPast } from "./graph-links";

const origin = "https://robots.example";

test("a link names the graph and what is chosen, and leads back to it", () => {
  const link = linkTo("a/b", ["AAAAAAAAAAAA", "AAAAAAAAAAAA>BBBBBBBBBBBB;1"], origin);
  const url = new URL(link);
  expect(url.pathname).toBe("/graphs/a%2Fb");
  expect(targetOf(url.search)).toEqual({
    selection: ["AAAAAAAAAAAA", "AAAAAAAAAAAA>BBBBBBBBBBBB;1"],
    problem: null,
    field: null,
  });
});

test("a link to a problem leads to its field, its place, or to the list", () => {
  const place = { where: { aid: "AAAAAAAAAAAA" } };
  const to = (...given: [Parameters<typeof linkToProblem>[1], string | null]) =>
    targetOf(new URL(linkToProblem("g", ...given, origin)).search);
  const selection = ["AAAAAAAAAAAA"];
  expect(to({ code: "H8", ...place }, null)).toEqual({ selection, problem: "H8", field: null });
  const field = "in/grip/x";
  expect(to({ code: "H8", ...place }, field)).toEqual({ selection, problem: "H8", field });
  expect(to({ code: "H6", where: {} }, null)).toEqual({
    selection: [],
    problem: "H6",
    field: null,
  });
});

test("an address without a target, or with too many, does no harm", () => {
  expect(targetOf("")).toBeNull();
  expect(targetOf("?utm=1")).toBeNull();
  expect(targetOf(`?${"action=x&".repeat(500)}`)?.selection).toHaveLength(20);
});

test("an address leads to a moment, and to what it is compared with", () => {
  expect(pastOf("?at=12")).toEqual({ at: 12, with: "own" });
  expect(pastOf("?at=12&with=now")).toEqual({ at: 12, with: "now" });
  expect(pastOf("?at=12&with=7")).toEqual({ at: 12, with: 7 });
  for (const odd of ["", "?at=0", "?at=x", "?at=1e3"]) expect(pastOf(odd)).toBeNull();
  expect(pastOf("?at=12&with=<b>")?.with).toBe("own");
});

test("other parts of an address stay", () => {
  expect(withPast("?action=a1&at=3&with=now", { at: 5, with: "own" })).toBe("?action=a1&at=5");
  expect(withPast("?at=3", null)).toBe("");
  expect(pastOf(withPast("", { at: 9, with: 4 }))).toEqual({ at: 9, with: 4 });
});
