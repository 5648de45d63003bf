import { expect, test } from "vitest";
import { viewKeyIn } from "./shared-things";

test("the fragment of an address names the thing and the key of a link, or nothing", () => {
  expect(viewKeyIn("#graph=view_abc_d-E_f")).toEqual({ kind: "graph", text: "view_abc_d-E_f" });
  expect(viewKeyIn("#run=view_abc_d")).toEqual({ kind: "run", text: "view_abc_d" });
  for (const other of [
    "",
    "#",
    "#t=view_a",
    "#run=aat_x",
    "#run=view_a&b",
    "#robot=view_a",
    "run=view_a",
  ]) {
    expect(viewKeyIn(other)).toBeNull();
  }
});
