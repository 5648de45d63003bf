import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf, relationId } from "./document-keys";
import { addAction, connect, rename, setEntry, setExit, setRequired, setResponse } from "./edit";
import type { Graph } from "./model";
import { readGraph } from "./read";
import { handOverWords } from "./relation-words";
import { handOverLabel, handOverOf, hasSeveralRobots, robotCounts, robotOf } from "./robots";

function drawn(...actors: string[]): { doc: Y.Doc; keys: string[]; arrows: string[] } {
  const doc = new Y.Doc();
  const keys = actors.map((actor, i) => addAction(doc, { name: `Step${i}`, actor }));
  const arrows = keys.slice(1).map((key, i) => connect(doc, keys[i] ?? "", key) ?? "");
  if (keys[0]) setEntry(doc, keys[0]);
  setExit(doc, keys.at(-1) ?? "");
  return { doc, keys, arrows };
}
const read = (doc: Y.Doc): Graph => readGraph(mapsOf(doc));
const handsOf = (graph: Graph) => {
  const robots = robotOf(graph);
  return graph.relations.flatMap((relation) => handOverOf(relation, robots) ?? []);
};

test("robots are told apart only where a graph names two or more", () => {
  for (const actors of [[], [""], ["Scout"], ["Scout", "Scout"], ["Scout", ""]]) {
    const graph = read(drawn(...actors).doc);
    expect(hasSeveralRobots(graph.actions)).toBe(false);
    expect(handsOf(graph)).toEqual([]);
  }
  expect(hasSeveralRobots(read(drawn("Scout", "Carrier").doc).actions)).toBe(true);
});

test("an action that any robot may do is a performer of its own beside two named ones", () => {
  const graph = read(drawn("Carrier", "Scout", "").doc);
  expect(new Set(handsOf(graph).map(handOverLabel))).toEqual(
    new Set(["Scout waits for Carrier", "any robot waits for Scout"]),
  );
  expect(robotCounts(graph.actions)).toEqual([
    ["Carrier", 1],
    ["Scout", 1],
    ["", 1],
  ]);
});

test("an arrow says who starts what, and when", () => {
  const { doc, arrows } = drawn("Carrier", "Scout");
  const [arrow = ""] = arrows;
  const words = () => {
    const graph = read(doc);
    const relation = graph.relations.find((each) => relationId(each) === arrow);
    return relation ? handOverWords(graph, relation) : [];
  };
  expect(words()).toEqual(["Scout starts Step1 when Carrier’s Step0 ends true."]);
  setResponse(doc, arrow, "on_error", "stop");
  setResponse(doc, arrow, "on_false", "run");
  expect(words()).toEqual([
    "Scout starts Step1 when Carrier’s Step0 ends true or ends false.",
    "Scout stops Step1, if it runs, when Carrier’s Step0 ends with an error.",
  ]);
});

test("an optional arrow is not waited for, and one that does nothing hands nothing over", () => {
  const { doc, arrows } = drawn("Carrier", "Scout");
  const [arrow = ""] = arrows;
  setRequired(doc, arrow, false);
  expect(handsOf(read(doc)).map(handOverLabel)).toEqual(["from Carrier to Scout"]);
  for (const outcome of ["on_true", "on_false", "on_error", "on_stopped"] as const)
    setResponse(doc, arrow, outcome, "restart");
  expect(handsOf(read(doc))).toEqual([]);
});

test("for any names an arrow hands over exactly where both actions have different robots", () => {
  const actor = fc.constantFrom("", "Scout", "Carrier", "scout", "\u202eevil", "a<b>&c");
  fc.assert(
    fc.property(fc.array(actor, { minLength: 2, maxLength: 6 }), (actors) => {
      const graph = read(drawn(...actors).doc);
      const several = new Set(actors.filter(Boolean)).size > 1;
      const pairs = actors.slice(1).map((to, i) => [actors[i] ?? "", to] as const);
      const crossing = several ? pairs.filter(([from, to]) => from !== to) : [];
      expect(
        handsOf(graph)
          .map(({ from, to }) => `${from}>${to}`)
          .sort(),
      ).toEqual(crossing.map(([from, to]) => `${from}>${to}`).sort());
    }),
  );
});

test("a name that turns its letters turns no word beside it", () => {
  const { doc, keys } = drawn("\u202ereirraC", "Scout");
  rename(doc, keys[0] ?? "", "\u202eoTevirD");
  const graph = read(doc);
  const [hand] = handsOf(graph);
  expect(hand && handOverLabel(hand)).toBe("Scout waits for \u2068\u202ereirraC\u2069");
  expect(graph.relations.flatMap((relation) => handOverWords(graph, relation))).toEqual([
    "Scout starts Step1 when \u2068\u202ereirraC\u2069’s \u2068\u202eoTevirD\u2069 ends true.",
  ]);
});
