import { expect, test } from "vitest";
import { blocksOf, groupOf } from "./groups";

const numbers = (...paths: string[]) =>
  paths.map((path) => ({ path, text: '{"pvf_type": "number"}' }));

const shape = (list: ReturnType<typeof numbers>) =>
  blocksOf(list).map((block) => {
    if (block.kind === "single") return block.parameter.path;
    if (block.kind === "group") return `${block.prefix} ${block.members.length}`;
    const rows = block.rows.map((row) => row.members.map(({ letter }) => letter).join(""));
    return `${block.prefix} ${block.word} ${rows.join(" ")}`;
  });

test("a point, a vector and a pose are one thing with rows", () => {
  const pose = ["x", "y", "z"].map((axis) => `grip/position/${axis}`);
  const turn = ["x", "y", "z", "w"].map((axis) => `grip/orientation/${axis}`);
  expect(shape(numbers("speed", ...pose, ...turn))).toEqual(["speed", "grip/ pose xyz xyzw"]);
  expect(shape(numbers("at/x", "at/y", "by/x", "by/yaw"))).toEqual([
    "at/ point xy",
    "by/ vector xyaw",
  ]);
});

test("anything else in a group stays a list", () => {
  expect(shape(numbers("at/width", "at/height"))).toEqual(["at/ 2"]);
  const limited = { path: "at/x", text: '{"pvf_type": "number", "pvf_allowed_values": [1]}' };
  expect(shape([limited, ...numbers("at/y")])).toEqual(["at/ 2"]);
  const words = { path: "at/x", text: '{"pvf_type": "string"}' };
  expect(shape([words, ...numbers("at/y")])).toEqual(["at/ 2"]);
});

test("a field of a row is called by its row", () => {
  const list = numbers("grip/position/x", "grip/position/y", "grip/orientation/x", "n/a", "n/b");
  expect(groupOf(list, "grip/position/x")).toBe("grip");
  expect(groupOf(list, "n/a")).toBe("n/a");
});
