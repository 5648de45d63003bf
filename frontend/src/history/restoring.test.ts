import { expect, test } from "vitest";
import { EMPTY_GRAPH } from "../graph/model";
import { anyAction } from "../testing/graphs";
import { leftWords } from "./restoring";

test("what was left is named, and only the first few", () => {
  const [a, b] = ["aaaaaaaaaaaa", "bbbbbbbbbbbb"];
  const actions = [
    { ...anyAction(a), name: "Drive" },
    { ...anyAction(b), name: "Grip" },
  ];
  const graph = { ...EMPTY_GRAPH, actions };
  expect(leftWords(graph, [])).toBe("");
  expect(leftWords(graph, [a, `${a}>${b}`])).toContain("since: Drive, Drive → Grip.");
  expect(leftWords(graph, [a, b, a, b, a, b])).toContain(" and 2 more.");
});
