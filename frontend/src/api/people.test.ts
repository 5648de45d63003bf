import fc from "fast-check";
import { expect, test } from "vitest";
import { type Colored, checkedColor, colorsOf, currentName, NOBODYS_COLOR } from "./people";

const color = fc.integer({ min: 0, max: 30 }).map((n) => `#0000${n.toString(16).padStart(2, "0")}`);
const people = fc.uniqueArray(fc.record({ id: fc.constantFrom(..."abcdefghijklmnop"), color }), {
  selector: ({ id }) => id,
});
const unlike = (list: readonly Colored[]) => [
  ...new Map(list.map((person) => [person.color, person])).values(),
];

test("nobody who has left is shown in the colour of somebody who is here, in whatever order", () => {
  fc.assert(
    fc.property(people.map(unlike), people, (here, known) => {
      const shown = colorsOf(here, known);
      expect(here.map(({ id }) => shown(id))).toEqual(here.map((person) => person.color));
      const taken = new Set(here.map((person) => person.color));
      for (const { id } of known) {
        if (here.every((person) => person.id !== id)) expect(taken.has(shown(id))).toBe(false);
      }
      const turned = colorsOf([...here].reverse(), [...known].reverse());
      for (const { id } of [...here]) expect(turned(id)).toBe(shown(id));
    }),
  );
});

test("what is no colour gets into no style", () => {
  expect(checkedColor("red;background:url(//x)")).toBe(NOBODYS_COLOR);
  expect(colorsOf([{ id: "a", color: "" }], [])("a")).toBe(NOBODYS_COLOR);
  expect(colorsOf([], [])("nobody")).toBe(NOBODYS_COLOR);
});

test("who has named themselves since is called by that name, whatever was stored of them then", () => {
  const me = { id: "me", name: "Ada" };
  const known = [
    { id: "b", name: "Bob" },
    { id: "me", name: "Old Ada" },
  ];
  expect(currentName({ id: "me", name: "" }, me, known)).toBe("Ada");
  expect(currentName({ id: "b", name: "" }, me, known)).toBe("Bob");
  expect(currentName({ id: "b", name: "Robert" }, me, known)).toBe("Bob");
  expect(currentName({ id: "gone", name: "Eve" }, me, known)).toBe("Eve"); // nobody knows of another name
  expect(currentName({ id: "gone", name: "" }, me, known)).toBe("somebody");
  expect(currentName(null, me, known)).toBe("somebody");
});
