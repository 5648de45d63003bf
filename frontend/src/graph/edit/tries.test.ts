import fc from "fast-check";
import { expect, test } from "vitest";
import type * as Y from "yjs";
import { arrowsOf, drawnBy, gestures, goesInCircles, namesIn } from "../../testing/drawn-graphs";
import { docWith, graphIn } from "../../testing/edited-graph";
import type { Key } from "../model";
import {
  addAction,
  addParameter,
  connect,
  setEntry,
  setExit,
  setField,
  setRequired,
  undoOf,
} from ".";
import { setAsk } from "./asks";
import { drawTries, type Failures, triesWords, whyNoTries } from "./tries";

const places = (times: number) => Array.from({ length: times - 1 }, (_, i) => [0, i] as const);
const tryAgain = (doc: Y.Doc, key: Key, times: number, failures: Failures = ["on_error"]) =>
  drawTries(doc, key, { failures, places: places(times) });

/** A leads to B when it is true, and to Handler when it fails; both end the graph. */
function handled(): [Y.Doc, Key, Key, Key] {
  const [doc, a, b, handler] = docWith("A", "B", "Handler") as [Y.Doc, Key, Key, Key];
  setEntry(doc, a);
  connect(doc, a, b, "on_true");
  connect(doc, a, handler, "on_error");
  setExit(doc, b);
  setExit(doc, handler);
  return [doc, a, b, handler];
}

test("each try begins when the one before it failed, and only the last one's failure is handled", () => {
  const [doc, a] = handled();
  expect(tryAgain(doc, a, 3)).toHaveLength(2);
  expect(arrowsOf(doc)).toEqual([
    "A B true ?",
    "A A#1 error",
    "A#1 B true ?",
    "A#1 A#2 error",
    "A#2 B true ?",
    "A#2 Handler error",
    "B exit true ?",
    "entry A true",
    "Handler exit true ?",
  ]);
});

test("an end with false is a failure too, if a person says so", () => {
  const [doc, a, b] = handled();
  connect(doc, a, b, "on_false");
  tryAgain(doc, a, 2, ["on_error", "on_false"]);
  expect(arrowsOf(doc).filter((arrow) => arrow.startsWith("A"))).toEqual([
    "A B true ?",
    "A A#1 false/error",
    "A#1 B true/false ?",
    "A#1 Handler error",
  ]);
});

test("it is one step of undo, and takes the values of the action along", () => {
  const [doc, a] = handled();
  addParameter(doc, a, "in", "place", '{"pvf_type": "string", "pvf_value": "dock"}');
  const before = JSON.stringify(graphIn(doc));
  const undo = undoOf(doc);
  tryAgain(doc, a, 4);
  const tried = graphIn(doc).actions.filter(({ name }) => name === "A");
  expect(new Set(tried.map(({ inputs }) => JSON.stringify(inputs))).size).toBe(1);
  expect(tried).toHaveLength(4);
  expect(undo.undoStack).toHaveLength(1);
  undo.undo();
  expect(JSON.stringify(graphIn(doc))).toBe(before);
});

const whyNot = (doc: Y.Doc, key: Key) => whyNoTries(graphIn(doc), key, false);
const TEXT = '{"pvf_type": "string", "pvf_value": "x"}';

test("nothing is drawn where the engine would not do exactly that, and a sentence says why", () => {
  const cases: [(doc: Y.Doc, a: Key, b: Key, handler: Key) => void, string][] = [
    [
      (doc, a) => addParameter(doc, a, "in", "place", '{"pvf_type": "string"}'),
      "A start asks for place",
    ],
    [
      (doc, a) => {
        addParameter(doc, a, "in", "place", TEXT);
        setAsk(doc, a, "place", {});
      },
      "A start asks for place",
    ],
    [
      (doc, a) => {
        const first = addAction(doc, { name: "Find" });
        addParameter(doc, first, "out", "place", '{"pvf_type": "string"}');
        addParameter(doc, a, "in", "place", TEXT);
        connect(doc, first, a);
      },
      "comes from another action",
    ],
    [
      (doc, a) => {
        addParameter(doc, a, "in", "place", TEXT);
        addParameter(doc, a, "out", "place", '{"pvf_type": "string"}');
      },
      "hand its own place",
    ],
    [
      (doc, a) =>
        addParameter(doc, a, "out", "seen", '{"pvf_type": "string", "pvf_allowed_values": ["x"]}'),
      "H13",
    ],
    [(doc, _a, b) => setField(doc, b, "type", "spontaneous"), "A spontaneous action"],
    [(doc, a, b) => connect(doc, b, a, "on_true", "stop"), "B stops or pauses it"],
    [(doc, a) => connect(doc, a, a, "on_false"), "leads to itself"],
    [
      (doc, a, b) => {
        const beside = addAction(doc, { name: "Beside" });
        setEntry(doc, beside);
        const id = connect(doc, beside, b) as string;
        setRequired(doc, id, true);
        setRequired(doc, `${a}>${b}`, true);
      },
      "B waits for it and for others",
    ],
  ];
  for (const [make, words] of cases) {
    const [doc, a, b, handler] = handled();
    expect(whyNot(doc, a)).toBeNull();
    make(doc, a, b, handler);
    expect(whyNot(doc, a)).toContain(words);
    const before = JSON.stringify(graphIn(doc));
    expect(tryAgain(doc, a, 3)).toBeNull();
    expect(JSON.stringify(graphIn(doc))).toBe(before);
  }
  const [doc, a] = handled();
  expect(whyNoTries(graphIn(doc), a, true)).toContain("stands for a graph");
});

test("a sentence says beforehand what is drawn", () => {
  const [doc, a, b] = handled();
  expect(triesWords(graphIn(doc), a, 3, ["on_error"])).toBe(
    "Draws 2 more of A. Each further try begins only if the one before it ended with an error. As soon as one try ends otherwise, the graph goes on from there. If the last one ends with an error, what now follows an error of A begins.",
  );
  expect(triesWords(graphIn(doc), b, 2, ["on_error", "on_false"])).toBe(
    "Draws one more of B. Each further try begins only if the one before it ended with an error or false. As soon as one try ends otherwise, the graph goes on from there. If the last one ends with an error or false, nothing follows.",
  );
});

const drawn = fc.record({
  made: gestures,
  chosen: fc.nat(99),
  times: fc.integer({ min: 2, max: 5 }),
  failures: fc.constantFrom<Failures>(["on_error"], ["on_error"], ["on_error", "on_false"]),
});

type Drawn = typeof drawn extends fc.Arbitrary<infer T> ? T : never;

/** Draws a graph and the tries of one of its actions; null where they cannot be drawn. */
function triedIn({ made, chosen, times, failures }: Drawn) {
  const doc = drawnBy(made);
  const { actions } = graphIn(doc);
  const key = actions[chosen % actions.length]?.key as Key;
  const before = arrowsOf(doc);
  const undo = undoOf(doc);
  const copies = tryAgain(doc, key, times, failures);
  return copies && { doc, undo, before, tries: [key, ...copies], failures };
}

test("in whatever graph, one undo takes all of it back", () => {
  fc.assert(
    fc.property(drawn, (given) => {
      const found = triedIn(given);
      if (found === null) return;
      expect(found.undo.undoStack).toHaveLength(1);
      found.undo.undo();
      expect(arrowsOf(found.doc)).toEqual(found.before);
    }),
    { numRuns: 15 },
  );
});

const LOTS = Number(process.env.DRAWN_GRAPHS ?? "0");

test("the tries that tests/umrf/test_drawn_tries.py plays are those that are drawn", async () => {
  const found = fc
    .sample(drawn, { seed: 20261130, numRuns: LOTS || 70 })
    .flatMap((given) => triedIn(given) ?? []);
  const lines = found
    .filter(({ before }) => !goesInCircles(before))
    .map(({ doc, before, tries, failures }) =>
      JSON.stringify({
        before,
        after: arrowsOf(doc),
        tries: tries.map(namesIn(doc)),
        failures,
      }),
    );
  expect(lines.length).toBeGreaterThan(20);
  const file = LOTS ? (process.env.TRIES_FILE ?? "") : "../../../../tests/vectors/tries.json";
  await expect(`[\n${lines.join(",\n")}\n]\n`).toMatchFileSnapshot(file);
}, 120_000);
