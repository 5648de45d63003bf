import fc from "fast-check";
import { expect, test } from "vitest";
import type * as Y from "yjs";
import { arrowsOf, drawnBy, gestures, goesInCircles } from "../../testing/drawn-graphs";
import { actionIn, docWith, graphIn } from "../../testing/edited-graph";
import type { Key } from "../model";
import { addAction, addParameter, connect, setEntry, setExit, undoOf } from ".";
import {
  copiesWords,
  drawCopies,
  type Varied,
  variedInputs,
  whyNoSeries,
  wrongValue,
} from "./series";

const PLACE: Varied = { kind: "input", path: "place" };
const ROBOT: Varied = { kind: "robot" };

function copied(doc: Y.Doc, keys: Key[], varied: Varied, values: string[], inSeries = true) {
  const by = values.map((_, i) => [0, 100 * (i + 1)] as const);
  return drawCopies(doc, new Set(keys), varied, { values, inSeries, by, places: new Map() });
}

/** Drive leads to Look when it is true and to Help when it fails; both end the graph. */
function driving(): [Y.Doc, Key, Key, Key] {
  const [doc, drive, look, help] = docWith("Drive", "Look", "Help") as [Y.Doc, Key, Key, Key];
  addParameter(doc, drive, "in", "place", '{"pvf_type": "string", "pvf_value": "dock"}');
  addParameter(doc, drive, "in", "speed", '{"pvf_type": "number", "pvf_value": 1.0}');
  setEntry(doc, drive);
  connect(doc, drive, look, "on_true");
  connect(doc, drive, help, "on_error");
  setExit(doc, look);
  setExit(doc, help);
  return [doc, drive, look, help];
}

test("each copy of a series follows the one before with its own value, and what followed comes last", () => {
  const [doc, drive] = driving();
  const made = copied(doc, [drive], PLACE, ["hall", "lab"]);
  expect(made?.flat().map((key) => actionIn(doc, key)?.inputs[0]?.text)).toEqual([
    '{"pvf_type": "string", "pvf_value": "hall"}',
    '{"pvf_type": "string", "pvf_value": "lab"}',
  ]);
  expect(arrowsOf(doc)).toEqual([
    "Drive Help error ?",
    "Drive Drive#1 true",
    "Drive#1 Help error ?",
    "Drive#1 Drive#2 true",
    "Drive#2 Look true",
    "Drive#2 Help error ?",
    "entry Drive true",
    "Help exit true ?",
    "Look exit true ?",
  ]);
});

test("several actions are repeated as they are connected", () => {
  const [doc, drive, look] = driving();
  copied(doc, [drive, look], PLACE, ["hall"]);
  expect(arrowsOf(doc)).toEqual([
    "Drive Look true",
    "Drive Help error ?",
    "Drive#1 Look#1 true",
    "Drive#1 Help error ?",
    "entry Drive true",
    "Help exit true ?",
    "Look Drive#1 true",
    "Look#1 exit true ?",
  ]);
});

test("copies side by side have the arrows among them, and another robot each", () => {
  const [doc, drive, look] = driving();
  const before = arrowsOf(doc);
  const made = copied(doc, [drive, look], ROBOT, ["Scout", "Carrier"], false);
  expect(made?.map((copy) => copy.map((key) => actionIn(doc, key)?.actor))).toEqual([
    ["Scout", "Scout"],
    ["Carrier", "Carrier"],
  ]);
  expect(arrowsOf(doc)).toEqual(
    expect.arrayContaining([...before, "Drive#1 Look#1 true", "Drive#2 Look#2 true"]),
  );
  expect(arrowsOf(doc)).toHaveLength(before.length + 2);
});

test("it is one step of undo", () => {
  const [doc, drive] = driving();
  const before = JSON.stringify(graphIn(doc));
  const undo = undoOf(doc);
  copied(doc, [drive], { kind: "input", path: "speed" }, ["2", ".5"]);
  expect(
    graphIn(doc)
      .actions.map(({ inputs }) => inputs[1]?.text)
      .filter(Boolean),
  ).toEqual([
    '{"pvf_type": "number", "pvf_value": 1.0}',
    '{"pvf_type": "number", "pvf_value": 2}',
    '{"pvf_type": "number", "pvf_value": 0.5}',
  ]);
  expect(undo.undoStack).toHaveLength(1);
  undo.undo();
  expect(JSON.stringify(graphIn(doc))).toBe(before);
});

test("a value that an input cannot have is named, and lists are no choice", () => {
  const [doc, drive] = driving();
  addParameter(doc, drive, "in", "places", '{"pvf_type": "strings"}');
  const actions = graphIn(doc).actions;
  expect(variedInputs(actions)).toEqual(["place", "speed"]);
  expect(wrongValue(actions, { kind: "input", path: "speed" }, "fast")).toContain("no number");
  expect(wrongValue(actions, PLACE, "fast")).toBeNull();
});

test("a series that would not go on or lose a value is refused, with the reason", () => {
  const cases: [(doc: Y.Doc, drive: Key, look: Key, help: Key) => Key[], string][] = [
    [(_doc, _drive, look, help) => [look, help], "no single beginning and end"],
    [
      (doc, drive, look) => {
        const other = addAction(doc, { name: "Other" });
        connect(doc, other, look);
        return [drive, look];
      },
      "An arrow from elsewhere leads to Look",
    ],
    [
      (doc, drive) => {
        const other = addAction(doc, { name: "Other" });
        addParameter(doc, other, "out", "speed", '{"pvf_type": "number"}');
        connect(doc, other, drive);
        return [drive];
      },
      "speed comes from another action",
    ],
    [
      (doc, drive) => {
        addParameter(doc, drive, "out", "place", '{"pvf_type": "string"}');
        return [drive];
      },
      "get place from the one before",
    ],
    [
      (doc, drive) => {
        addParameter(doc, drive, "out", "speed", '{"pvf_type": "number"}');
        return [drive];
      },
      "get speed from the one before",
    ],
    [
      (doc, drive) => {
        const watch = addAction(doc, { name: "Watch" });
        connect(doc, watch, drive, "on_true", "stop");
        return [drive];
      },
      "Watch stops or pauses it",
    ],
  ];
  for (const [make, words] of cases) {
    const [doc, ...keys] = driving();
    const chosen = make(doc, ...keys);
    expect(whyNoSeries(graphIn(doc), new Set(chosen), PLACE)).toContain(words);
    const before = JSON.stringify(graphIn(doc));
    expect(copied(doc, chosen, PLACE, ["hall"])).toBeNull();
    expect(JSON.stringify(graphIn(doc))).toBe(before);
  }
});

test("a sentence says beforehand what is drawn", () => {
  const [doc, drive, look] = driving();
  expect(
    copiesWords(graphIn(doc), new Set([drive]), PLACE, { values: ["hall", "lab"], inSeries: true }),
  ).toBe(
    "Draws 2 copies of Drive with place hall, lab, one after another behind it; the last copy leads on to what followed Drive when it ended true.",
  );
  expect(
    copiesWords(graphIn(doc), new Set([drive, look]), ROBOT, {
      values: ["Scout"],
      inSeries: false,
    }),
  ).toBe(
    "Draws one copy of Drive, Look with robot Scout, side by side, with no arrows from elsewhere.",
  );
});

const LOTS = Number(process.env.DRAWN_GRAPHS ?? "0");

test("the series that tests/umrf/test_drawn_graphs.py plays are those that are drawn", async () => {
  const chosen = fc.tuple(gestures, fc.nat(99), fc.integer({ min: 1, max: 3 }), fc.nat(1));
  const lines = fc.sample(chosen, { seed: 20261130, numRuns: LOTS || 70 }).flatMap((given) => {
    const [made, one, count, more] = given;
    const doc = drawnBy(made);
    const { actions, relations } = graphIn(doc);
    const keys = [actions[one % actions.length]?.key as Key];
    while (keys.length <= more) {
      const following = relations.filter(
        ({ parent, conditions }) => parent === keys.at(-1) && conditions.on_true === "run",
      );
      // The keys are drawn by lot, so their order says nothing.
      const next = actions.find(
        ({ key }) => !keys.includes(key) && following.some(({ child }) => child === key),
      );
      if (!next) break;
      keys.push(next.key);
    }
    const values = Array.from({ length: count }, (_, i) => `R${i}`);
    const isDrawn = !goesInCircles(arrowsOf(doc)) && copied(doc, keys, ROBOT, values) !== null;
    return isDrawn ? [JSON.stringify(arrowsOf(doc))] : [];
  });
  expect(lines.length).toBeGreaterThan(20);
  const file = LOTS ? (process.env.SERIES_FILE ?? "") : "../../../../tests/vectors/series.json";
  await expect(`[\n${lines.join(",\n")}\n]\n`).toMatchFileSnapshot(file);
}, 120_000);
