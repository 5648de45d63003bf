// @vitest-environment jsdom
import fc from "fast-check";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test } from "vitest";
import {
  colorNumbers,
  colorOfName,
  initials,
  NAME_RANK,
  nameColors,
  useNameColors,
} from "./name-colors";

test.each([
  ["Ada", "AD"],
  ["Ada Lovelace", "AL"],
  ["Ada of the House Lovelace", "AL"],
  ["名前 さん", "名さ"],
  ["اسم", "اس"],
  ["🤖🏳️‍🌈", "🤖🏳️‍🌈"],
  ["👩‍🚀 Kai", "👩‍🚀K"],
  ["é", "É"],
  ["  ", "?"],
  ["", "?"],
])("the initials of %s are whole letters", (name, letters) => {
  expect(initials(name)).toBe(letters);
});

test("a name that piles up marks does not pile up here", () => {
  expect(initials(`Z${"\u0300".repeat(5000)}`).length).toBeLessThan(30);
});

const names = fc.uniqueArray(fc.string({ maxLength: 12 }), { maxLength: 14 });
const some = (count: number) =>
  fc.uniqueArray(fc.string({ minLength: 1, maxLength: 12 }), { maxLength: count });

test("Carrier and Scout, and the robots that play them, are told apart", () => {
  const colors = colorNumbers([
    ["Scout", "Carrier"],
    ["David", "Carol"],
  ]);
  expect(new Set(colors.values()).size).toBe(4);
});

test("up to six names have as many colours", () => {
  fc.assert(
    fc.property(some(6), (group) => {
      expect(new Set(colorNumbers([group]).values()).size).toBe(group.length);
    }),
  );
});

test("of more names, each colour has about as many", () => {
  fc.assert(
    fc.property(names, (group) => {
      const counts = new Map<number, number>();
      for (const color of colorNumbers([group]).values())
        counts.set(color, (counts.get(color) ?? 0) + 1);
      const most = Math.ceil(group.filter((name) => name !== "").length / 6);
      expect(Math.max(0, ...counts.values())).toBeLessThanOrEqual(most);
    }),
  );
});

test("colours depend on no order, and on no names of later groups", () => {
  fc.assert(
    fc.property(names, names, (first, later) => {
      const alone = colorNumbers([first]);
      const both = colorNumbers([[...first, ...first].reverse(), later]);
      for (const [name, color] of alone) expect(both.get(name)).toBe(color);
      expect(new Set(both.keys())).toEqual(new Set([...first, ...later].filter((n) => n !== "")));
    }),
  );
});

test("each name has a variable of its own, whatever it is called", () => {
  fc.assert(
    fc.property(some(8), (group) => {
      const found = group.map(colorOfName);
      expect(new Set(found).size).toBe(group.length);
      for (const color of found)
        expect(color).toMatch(/^var\(--name-[0-9a-f_-]+, var\(--robot-[0-5]\)\)$/);
    }),
  );
});

function Named({ rank, names }: { rank: number; names: string[] }) {
  useNameColors(rank, names);
  return null;
}

test("the page shows the chosen colours until the part with these names is gone", () => {
  const colorNow = (name: string) =>
    document.documentElement.style.getPropertyValue(
      /--name-[\w-]+/.exec(colorOfName(name))?.[0] ?? "",
    );
  const root = document.documentElement.style;
  const [actors, robots] = [createRoot(document.body), createRoot(document.createElement("div"))];
  act(() => actors.render(<Named rank={NAME_RANK.actors} names={["Scout", "Carrier"]} />));
  const [scout, carrier] = [colorNow("Scout"), colorNow("Carrier")];
  expect(scout).toMatch(/^var\(--robot-\d\)$/);
  expect(carrier).not.toBe(scout);
  act(() => robots.render(<Named rank={NAME_RANK.robots} names={["A", "B", "C", "D", "E"]} />));
  expect([colorNow("Scout"), colorNow("Carrier")]).toEqual([scout, carrier]);
  act(() => actors.unmount());
  act(() => robots.unmount());
  expect(root.length).toBe(0);
});

test("colours of one card hold for that card", () => {
  expect(new Set(Object.values(nameColors(["Scout", "Carrier"]))).size).toBe(2);
});
