import { expect, test } from "vitest";
import { type KnownAction, type KnownGraph, placeable } from "./known-actions";

const inputs = (...paths: string[]) => paths.map((path) => ({ path, text: "{}" }));
const action = (name: string, document: string | null, ...paths: string[]): KnownAction => ({
  template: { name, inputs: inputs(...paths) },
  document,
  usedIn: [],
  takes: [],
  gives: [],
});
const graph = (id: string, name: string, ...paths: string[]): KnownGraph => ({
  graph: id,
  template: { name, inputs: inputs(...paths) },
});
const names = (list: readonly { template: { name: string } }[]) =>
  list.map(({ template }) => template.name);

test("a graph is not offered inside itself, and of two of one name one", () => {
  const graphs = [graph("g1", "round"), graph("g2", "fetch"), graph("g3", "fetch")];
  expect(names(placeable([], graphs, "g1").graphs)).toEqual(["fetch"]);
});

test("what stands for a graph elsewhere is listed as the graph", () => {
  const graphs = [graph("g1", "fetch", "goal", "speed")];
  const uses = [action("fetch", null, "speed", "goal"), action("Wait", null)];
  const { actions, graphs: shown } = placeable(uses, graphs, undefined);
  expect([names(actions), names(shown)]).toEqual([["Wait"], ["fetch"]]);
});

test("an action of the library comes before a graph of its name, another is listed beside it", () => {
  const graphs = [graph("g1", "Drive"), graph("g2", "Look")];
  const known = [action("Drive", "d1"), action("Look", null, "angle")];
  const { actions, graphs: shown } = placeable(known, graphs, undefined);
  expect([names(actions), names(shown)]).toEqual([["Drive", "Look"], ["Look"]]);
});
