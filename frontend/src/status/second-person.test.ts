import { expect, test } from "vitest";
import type { Preflight } from "../api/robots";
import { demandsIn } from "./second-person";

function look(engine: string, digest: string, text: string): Preflight {
  const items = [{ code: "approved", verdict: "blocked", text: "" }];
  const order = [{ what: "Limit", text }];
  return { engine, items, order, order_digest: digest } as unknown as Preflight;
}

test("robots with other limits need a yes each, and those of one order share it", () => {
  const looks = [look("David", "a", "60"), look("Carol", "b", "70"), look("Ed", "a", "60")];
  expect(demandsIn(looks).map(({ digest, robots }) => [digest, robots])).toEqual([
    ["a", ["David", "Ed"]],
    ["b", ["Carol"]],
  ]);
  expect(demandsIn([{ ...look("David", "a", ""), items: [] }])).toEqual([]);
});
