import { expect, test } from "vitest";
import type { Rule } from "../api/graph-rights";
import { ruleWords } from "./rule-dialog";

const nameOf = (id: string) => id;

test.each<[Rule, string]>([
  [{ readers: "all", editors: "all" }, "Everybody may see and edit it."],
  [{ readers: "all", editors: ["Ann"] }, "Everybody may see it. Only Ann may edit it."],
  [{ readers: "all", editors: [] }, "Everybody may see it. Only owners may edit it."],
  [{ readers: [], editors: [] }, "Only owners may see it."],
  [{ readers: ["Ann", "Bo", "Cy"], editors: "all" }, "Only Ann, Bo and Cy may see and edit it."],
  [{ readers: [], editors: "all" }, "Only owners may see it."],
  [{ readers: ["Ann"], editors: [] }, "Only Ann may see it. Only owners may edit it."],
  [{ readers: ["Ann"], editors: ["Bo"] }, "Only Ann and Bo may see it. Only Bo may edit it."],
  [{ readers: [], editors: ["Bo"] }, "Only Bo may see and edit it."],
])("says %j in words", (rule, words) => {
  expect(ruleWords(rule, "it", nameOf)).toBe(words);
});
