import { expect, test } from "vitest";
import type { TakenFiles } from "./take-files";
import { placeAfter } from "./take-files";

const made = (id: string) => ({ id }) as TakenFiles["taken"][number]["made"];

test("after an import one is where something came", () => {
  const [graph, action] = [
    { kind: "graph", made: made("g") },
    { kind: "action", made: made("a") },
  ] as const;
  expect(placeAfter({ taken: [], known: [] })).toBeNull();
  expect(placeAfter({ taken: [action], known: [] })).toBe("/actions/a");
  expect(placeAfter({ taken: [action, action], known: [] })).toBe("/actions");
  expect(placeAfter({ taken: [action, graph], known: [] })).toBe("/graphs/g");
  const known = [{ file: "x", document: "d", text: "" }];
  expect(placeAfter({ taken: [], known })).toBe("/actions/d");
});
