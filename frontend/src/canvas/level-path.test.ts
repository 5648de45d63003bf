import fc from "fast-check";
import { expect, test } from "vitest";
import { addressAround, addressInside, type Level, levelsOf } from "./level-path";

const id = fc.stringMatching(/^[\w-]{1,12}$/);
const level: fc.Arbitrary<Level> = fc.record({ graph: id, action: id });
const searchOf = (address: string) => new URL(address, "http://here").search;

test("leaving inner graphs leads back through the same actions", () => {
  fc.assert(
    fc.property(fc.array(level, { minLength: 1, maxLength: 20 }), id, (way, last) => {
      let search = "";
      for (const [n, from] of way.entries())
        search = searchOf(addressInside(search, [from], way[n + 1]?.graph ?? last));
      expect(levelsOf(search)).toEqual(way);
      for (let n = way.length - 1; n >= 0; n -= 1) {
        const out = addressAround(search, n) ?? "";
        expect(new URL(out, "http://here").pathname).toBe(`/graphs/${way[n]?.graph}`);
        expect(new URLSearchParams(searchOf(out)).get("action")).toBe(way[n]?.action);
        search = searchOf(out);
        expect(levelsOf(search)).toEqual(way.slice(0, n));
      }
      expect(addressAround(search, 0)).toBeNull();
    }),
  );
});

test("an invalid address leads to no other page, and its length is bounded", () => {
  expect(levelsOf("?in=../x~y&in=a&in=a~b~c&in=a~b")).toEqual([{ graph: "a", action: "b" }]);
  fc.assert(
    fc.property(fc.string(), fc.string(), (search, text) => {
      const made = `?${new URLSearchParams({ in: text })}&${search}`;
      for (const { graph, action } of levelsOf(made))
        expect(`${graph}${action}`).toMatch(/^[\w-]+$/);
    }),
  );
  let search = "";
  for (let n = 0; n < 50; n += 1)
    search = searchOf(addressInside(search, [{ graph: `g${n}`, action: "a" }], "h"));
  expect(levelsOf(search).map(({ graph }) => graph)).toEqual(
    Array.from({ length: 20 }, (_, n) => `g${n + 30}`),
  );
});
