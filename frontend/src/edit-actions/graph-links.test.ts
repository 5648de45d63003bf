import { expect, test } from "vitest";
import { linkTo, linkToProblem, targetOf } from "./graph-links";

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
