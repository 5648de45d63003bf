import { expect, test } from "vitest";
import { foldedIn, withFolded } from "./use-folded-frames";

test("what is folded is kept by graph, and what is unfolded leaves nothing behind", () => {
  const one = withFolded({}, "a", ["g/1", "g/2"], true);
  const two = withFolded(one, "b", ["g/1"], true);
  expect([...foldedIn(two, "a")]).toEqual(["g/1", "g/2"]);
  expect(withFolded(two, "a", ["g/1", "g/2"], false)).toEqual({ b: ["g/1"] });
});

test("what was kept in another shape folds nothing", () => {
  for (const odd of [null, 5, "x", [], { a: 5 }, { a: { length: 2 } }]) {
    expect(foldedIn(odd, "a").size).toBe(0);
    expect(withFolded(odd, "a", ["g/1"], true)).toMatchObject({ a: ["g/1"] });
  }
  expect([...foldedIn({ a: [1, "g/1", null] }, "a")]).toEqual(["g/1"]);
});

test("of many graphs the device keeps those that were changed last", () => {
  let kept = withFolded({}, "first", ["g/1"], true);
  for (let i = 0; i < 200; i += 1) kept = withFolded(kept, `graph ${i}`, ["g/1"], true);
  expect(Object.keys(kept)).toHaveLength(200);
  expect(kept.first).toBeUndefined();
});
