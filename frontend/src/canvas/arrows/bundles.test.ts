import fc from "fast-check";
import { expect, test } from "vitest";
import { ENTRY, IGNORE_ALL, PRECONDITIONS, RESPONSES, type Relation } from "../../graph/model";
import { bundlesOf, pillSizeOf, pillWord } from "./bundles";

const relation = (more: Partial<Relation>): Relation => ({
  ...{ parent: "a", child: "b", listing: 0, conditions: IGNORE_ALL, required: true },
  ...{ remap: [], only: null, parentOrder: 0, childOrder: 0, parentsExtra: [], childrenExtra: [] },
  ...more,
});

const conditions = fc.record({
  on_true: fc.constantFrom(...RESPONSES),
  on_false: fc.constantFrom(...RESPONSES),
  on_error: fc.constantFrom(...RESPONSES),
  on_stopped: fc.constantFrom(...RESPONSES),
});

test("every outcome that is answered is on one line, with those of the same response", () => {
  fc.assert(
    fc.property(conditions, fc.boolean(), (conditions, required) => {
      const bundles = bundlesOf(relation({ conditions, required }));
      const answered = PRECONDITIONS.filter((outcome) => conditions[outcome] !== "ignore");
      const drawn = bundles.flatMap(({ outcomes }) => outcomes);
      expect([...drawn].sort()).toEqual([...answered].sort());
      expect(bundles.length).toBe(Math.max(1, new Set(answered.map((o) => conditions[o])).size));
      expect(new Set(bundles.map(({ id }) => id)).size).toBe(bundles.length);
      for (const { outcomes, response, optional } of bundles) {
        expect(optional).toBe(!required);
        expect(outcomes.every((outcome) => conditions[outcome] === response)).toBe(true);
        expect([...outcomes]).toEqual(PRECONDITIONS.filter((each) => outcomes.includes(each)));
      }
    }),
  );
});

test("run is what is meant when nothing is said, and what is ignored is not drawn", () => {
  const said = { ...IGNORE_ALL, on_true: "run", on_error: "run", on_false: "stop" } as const;
  const bundles = bundlesOf(relation({ conditions: said }));
  expect(bundles.map((bundle) => [bundle.outcomes.join(), pillWord(bundle)])).toEqual([
    ["on_true,on_error", ""],
    ["on_false", "stop"],
  ]);
});

test("a relation that ignores everything still has a line, which says so", () => {
  const [only, ...others] = bundlesOf(relation({}));
  expect([only && pillWord(only), only?.outcomes, others]).toEqual(["ignores all", [], []]);
});

test("a line keeps its id while outcomes come and go", () => {
  const some = bundlesOf(relation({ conditions: { ...IGNORE_ALL, on_error: "run" } }));
  const more = bundlesOf(
    relation({ conditions: { ...IGNORE_ALL, on_true: "run", on_error: "run" } }),
  );
  expect(some.map(({ id }) => id)).toEqual(more.map(({ id }) => id));
});

test("the entry says nothing, unless something is wrong there; more to say needs more room", () => {
  const [entry] = bundlesOf(
    relation({ parent: ENTRY, conditions: { ...IGNORE_ALL, on_true: "run" } }),
  );
  expect(entry && pillSizeOf(entry, false)).toBeNull();
  expect(entry && pillSizeOf(entry, true)).not.toBeNull();
  const wide = (conditions: Relation["conditions"]) => {
    const [bundle] = bundlesOf(relation({ conditions }));
    return (bundle && pillSizeOf(bundle, false)?.width) ?? 0;
  };
  const one = wide({ ...IGNORE_ALL, on_true: "run" });
  expect(wide({ ...IGNORE_ALL, on_true: "run", on_false: "run" })).toBeGreaterThan(one);
  expect(wide({ ...IGNORE_ALL, on_true: "restart" })).toBeGreaterThan(one);
});
