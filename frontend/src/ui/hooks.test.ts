import { expect, test } from "vitest";
import { keptIn, withKept } from "./hooks";

test("what was put is kept by graph, and what is taken away leaves nothing behind", () => {
  const one = withKept({}, "a", ["g/1", "g/2"], true);
  const two = withKept(one, "b", ["g/1"], true);
  expect([...keptIn(two, "a")]).toEqual(["g/1", "g/2"]);
  expect(withKept(two, "a", ["g/1", "g/2"], false)).toEqual({ b: ["g/1"] });
});

test("what was kept in another shape is nothing", () => {
  for (const odd of [null, 5, "x", [], { a: 5 }, { a: { length: 2 } }]) {
    expect(keptIn(odd, "a").size).toBe(0);
    expect(withKept(odd, "a", ["g/1"], true)).toMatchObject({ a: ["g/1"] });
  }
  expect([...keptIn({ a: [1, "g/1", null] }, "a")]).toEqual(["g/1"]);
});

test("of many graphs the device keeps those that were changed last", () => {
  let kept = withKept({}, "first", ["g/1"], true);
  for (let i = 0; i < 200; i += 1) kept = withKept(kept, `graph ${i}`, ["g/1"], true);
  expect(Object.keys(kept)).toHaveLength(200);
  expect(kept.first).toBeUndefined();
});
