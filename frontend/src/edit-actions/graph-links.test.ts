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
  });
});

test("a link to a problem leads to its place, or to the list", () => {
  const here = linkToProblem("g", { code: "H8", where: { aid: "AAAAAAAAAAAA" } }, origin);
  expect(targetOf(new URL(here).search)).toEqual({ selection: ["AAAAAAAAAAAA"], problem: "H8" });
  const all = linkToProblem("g", { code: "H6", where: {} }, origin);
  expect(targetOf(new URL(all).search)).toEqual({ selection: [], problem: "H6" });
});

test("an address without a target, or with too many, does no harm", () => {
  expect(targetOf("")).toBeNull();
  expect(targetOf("?utm=1")).toBeNull();
  expect(targetOf(`?${"action=x&".repeat(500)}`)?.selection).toHaveLength(20);
});
