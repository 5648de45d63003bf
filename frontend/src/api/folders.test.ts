import fc from "fast-check";
import { expect, test } from "vitest";
import { type Folder, folderPath, foldersInOrder, foldersWithin, folderWay } from "./folders";

const folder = (id: string, parent?: string): Folder => ({
  id,
  name: id.toUpperCase(),
  ...(parent === undefined ? {} : { parent }),
});
const folders = [folder("a"), folder("b", "a"), folder("c", "b"), folder("d")];

test("a folder is found by its way, and an unknown one has none", () => {
  expect(folderWay(folders, "c").map(({ id }) => id)).toEqual(["a", "b", "c"]);
  expect(folderPath(folders, "c")).toBe("A / B / C");
  expect([folderWay(folders, null), folderWay(folders, "gone")]).toEqual([[], []]);
});

test("what lies in a folder is what lies in those inside of it, too", () => {
  expect([...foldersWithin(folders, "a")]).toEqual(["a", "b", "c"]);
  expect([...foldersWithin(folders, "d")]).toEqual(["d"]);
});

test("of any tree each folder stands once, behind the one around it", () => {
  fc.assert(
    fc.property(fc.array(fc.nat(), { maxLength: 12 }), (parents) => {
      const tree = parents.map((n, i) => folder(`${i}`, i === 0 ? undefined : `${n % i}`));
      const order = foldersInOrder(tree);
      expect(order.map(({ folder: { id } }) => id).sort()).toEqual(tree.map(({ id }) => id).sort());
      for (const [at, { folder: each, depth }] of order.entries()) {
        expect(folderWay(tree, each.id).length).toBe(depth + 1);
        const parent = order.findIndex(({ folder: { id } }) => id === each.parent);
        expect(parent).toBeLessThan(at);
      }
    }),
  );
});
