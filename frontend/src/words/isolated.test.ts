import { expect, test } from "vitest";
import { isolated } from "./isolated";

test("a name that turns words around ends with itself, and any other stays as it is", () => {
  expect(isolated("Pick and place 2, läuft")).toBe("Pick and place 2, läuft");
  expect(isolated("a\u202eb")).toBe("\u2068a\u202eb\u2069");
  expect(isolated("רובוט")).toBe("\u2068רובוט\u2069");
});

test("no name ends its own isolate, nor keeps it open", () => {
  for (const name of ["a\u2069\u202eb", "\u2067a", "\u2066\u2066\u2069"]) {
    expect(isolated(name).slice(1, -1)).not.toMatch(/[\u2066-\u2069]/);
    expect(isolated(name)).toMatch(/^\u2068.*\u2069$/s);
  }
});
