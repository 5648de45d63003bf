import fc from "fast-check";
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

test("words with isolated names stay as they are within another isolate, which ends at its end", () => {
  const both = `${isolated("רובוט")} and ${isolated("a\u202eb")}`;
  expect(isolated(both)).toBe(`\u2068${both}\u2069`);
  const parts = fc.constantFrom(..."\u202a\u202b\u202e\u2066\u2067\u2068\u2069\u200fa 1א");
  fc.assert(
    fc.property(fc.string({ unit: parts }), (name) => {
      const said = `Stop of ${isolated(name)} is proven`;
      let open = 0;
      for (const letter of said) {
        if (/[\u2066-\u2068]/.test(letter)) open += 1;
        else if (letter === "\u2069") open -= 1;
        else if (open === 0) expect(letter).not.toMatch(/[\u202a-\u202e\u200fא]/);
        expect(open).toBeGreaterThanOrEqual(0);
      }
      expect(open).toBe(0);
    }),
  );
});
