/** What the server reduces a graph to is drawn as the whole graph was: vectors that the server reads, too. */
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";
import type { Thumbnail } from "../api/thumbnails";
import { fromUmrf } from "../canvas/from-umrf";
import { arrangedByRank } from "../canvas/geometry/ranks";
import { outcomeColor } from "../canvas/outcome";
import { ENTRY, EXIT, type Graph, spokenOutcomes } from "../graph/model";
import { miniatureOf } from "./graph-preview";

const ROOT = new URL("../../../", import.meta.url);
const read = (path: string) => JSON.parse(readFileSync(fileURLToPath(new URL(path, ROOT)), "utf8"));
const vectors = Object.entries(
  read("tests/vectors/thumbnails.json") as Readonly<Record<string, Thumbnail>>,
);

function placesOf({ actions, relations }: Graph) {
  const end = { width: 44, height: 44 };
  const sizes = new Map([
    [ENTRY, end],
    ...actions.map(({ key }) => [key, { width: 150, height: 84 }] as const),
    [EXIT, end],
  ]);
  return arrangedByRank({ actions, relations }, sizes, "right");
}

test("there are vectors", () => expect(vectors.length).toBeGreaterThan(3));

test.each(vectors)("the cards of %s stand where the graph has them", (file, thumbnail) => {
  const graph = fromUmrf(read(`server/action_assistant/examples/${file}`));
  const { boxes, cards } = miniatureOf(thumbnail);
  const places = placesOf(graph);
  const keys = new Map(graph.actions.map(({ key }, i) => [key, `${i + 1}`]));
  for (const [key, [x, y]] of places)
    expect(boxes.get(keys.get(key) ?? key)).toMatchObject({ x, y });
  expect(boxes.size).toBe(places.size);
  expect([...cards.values()]).toEqual(
    graph.actions.map(({ actor, name }) => ({ robot: actor, letters: Math.min(15, name.length) })),
  );
});

test.each(vectors)("the arrows of %s have their ends and colours", (file, thumbnail) => {
  const { actions, relations } = fromUmrf(read(`server/action_assistant/examples/${file}`));
  const keys = new Map(actions.map(({ key }, i) => [key, `${i + 1}`]));
  const expected = relations.map(({ parent, child, conditions }) => {
    const color = outcomeColor[spokenOutcomes(conditions)[0] ?? "on_true"];
    const ends = `${keys.get(parent) ?? parent}>${keys.get(child) ?? child}`;
    return `${ends} ${parent === ENTRY ? "var(--ink4)" : color}`;
  });
  const found = miniatureOf(thumbnail).arrows.map(
    ({ parent, child, color }) => `${parent}>${child} ${color}`,
  );
  expect(found).toEqual(expected); // of two that overlap, the later one is seen
});
