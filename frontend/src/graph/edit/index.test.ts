import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import {
  actionIn,
  arrows,
  copyOf,
  docWith,
  exchange,
  graphIn,
  relationIn,
  says,
  updatesOf,
} from "../../testing/edited-graph";
import { mapsOf, relationId } from "../document-keys";
import { ENTRY, EXIT, fullName, type Key } from "../model";
import { readGraph } from "../read";
import {
  addAction,
  addNote,
  addParameter,
  asOneEdit,
  connect,
  insertInto,
  moveActions,
  moveLoose,
  moveRelation,
  parametersFrom,
  placeFirst,
  removeActions,
  removeNotes,
  removeParameter,
  removeRelation,
  rename,
  renameDocument,
  renameParameter,
  setDirection,
  setEntry,
  setExit,
  setField,
  setGraphDescription,
  setGraphName,
  setNote,
  setParameter,
  setRemap,
  setRequired,
  setResponse,
  undoOf,
} from ".";
import type { UndoHistory } from "./undo-history";

// -- actions ----------------------------------------------------------------------------------

test("an added action has what the library says of it, and the lowest free number", () => {
  const [doc, first] = docWith("Scan", "Scan", "Grip") as [Y.Doc, Key];
  removeActions(doc, [first]);
  const key = addAction(doc, {
    name: "Scan",
    type: "async",
    actor: "robot",
    description: "Looks around",
    inputs: parametersFrom({ pose: { x: { pvf_type: "number" } }, empty: {} }),
    outputs: parametersFrom({ found: { pvf_type: "bool" } }),
    position: [10, 20],
  });
  expect(actionIn(doc, key)).toMatchObject({
    instanceId: 0,
    type: "async",
    actor: "robot",
    description: "Looks around",
    inputs: [
      { path: "pose/x", text: '{"pvf_type":"number"}' },
      { path: "empty", text: "{}" },
    ],
    outputs: [{ path: "found", text: '{"pvf_type":"bool"}' }],
    position: [10, 20],
  });
  expect(graphIn(doc).actions.map(fullName)).toEqual(["Scan_1", "Grip_0", "Scan_0"]);
});

test("a document of the library has the name of its action, changed by one edit", () => {
  const [doc, key] = docWith("Scan") as [Y.Doc, Key];
  expect(updatesOf(doc, () => renameDocument(doc, key, "Look"))).toBe(1);
  expect(actionIn(doc, key)?.name).toBe("Look");
  expect(graphIn(doc).name).toBe("Look");
  expect(updatesOf(doc, () => renameDocument(doc, "gone", "Other"))).toBe(0);
  expect(graphIn(doc).name).toBe("Look");
});

test("each edit is one update for the others, and one that changes nothing is none", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  expect(updatesOf(doc, () => connect(doc, a, b))).toBe(1);
  expect(updatesOf(doc, () => connect(doc, a, b))).toBe(0);
  expect(updatesOf(doc, () => setField(doc, a, "actor", "r"))).toBe(1);
  expect(updatesOf(doc, () => setField(doc, a, "actor", "r"))).toBe(0);
  expect(updatesOf(doc, () => moveActions(doc, [[a, [1, 2]]]))).toBe(1);
  expect(updatesOf(doc, () => moveActions(doc, [[a, [1, 2]]]))).toBe(0);
  const two = () =>
    asOneEdit(doc, () => {
      setGraphName(doc, "g");
      setGraphDescription(doc, "d");
    });
  expect(updatesOf(doc, two)).toBe(1);
  expect(updatesOf(doc, () => removeActions(doc, [a, b]))).toBe(1);
});

test("removing an action leaves nothing of it", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  setEntry(doc, a);
  connect(doc, a, b, "on_error");
  setExit(doc, b);
  moveActions(doc, [[a, [1, 2]]]);
  setField(doc, a, "description", "gone soon");
  removeActions(doc, [a, ENTRY]);
  const left = Object.values(mapsOf(doc)).flatMap((map) => [...map.keys()]);
  expect(left.filter((key) => key.includes(a))).toEqual([]);
  expect(arrows(doc)).toEqual(["B>exit"]);
});

test("healing runs what would have followed the success of what was removed", () => {
  const [doc, a, x, y, b, c] = docWith("A", "X", "Y", "B", "C") as [Y.Doc, ...Key[]] as [
    Y.Doc,
    Key,
    Key,
    Key,
    Key,
    Key,
  ];
  connect(doc, a, x, "on_false");
  connect(doc, x, y);
  connect(doc, y, b);
  connect(doc, y, c, "on_error");
  connect(doc, y, y, "on_false");
  removeActions(doc, [x, y], { heal: true });
  expect(arrows(doc)).toEqual(["A>B"]);
  expect(says(graphIn(doc).relations[0])).toEqual(["on_false -> run"]);
});

test("a renamed action keeps its number unless the new name has it already", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const second = addAction(doc, { name: "A" });
  rename(doc, second, "C");
  expect(fullName(actionIn(doc, second) as never)).toBe("C_1");
  rename(doc, b, "A");
  expect(fullName(actionIn(doc, b) as never)).toBe("A_1");
  expect(fullName(actionIn(doc, a) as never)).toBe("A_0");
  expect(rename(doc, "nobodynobody", "X")).toBe(false);
});

test("a number that another action has is shared out; a twin that is renumbered is none any more", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const twin = addAction(doc, { name: "A" });
  doc.getMap("actions").set(`${twin}|instance_id`, 0);
  doc.getMap("actions").set(`${twin}|twin`, true);
  expect(graphIn(doc).actions.map(fullName)).toEqual(["A_0", "A_0"]);
  setField(doc, twin, "instanceId", 4);
  expect(actionIn(doc, twin)).toMatchObject({ instanceId: 4, twin: false });
  setField(doc, twin, "instanceId", 0);
  expect(
    graphIn(doc)
      .actions.map((action) => action.instanceId)
      .sort(),
  ).toEqual([0, 1]);
  expect(actionIn(doc, a)).toBeDefined();
});

test("an imported value that did not fit gives way to the first edit of its field", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  const id = connect(doc, a, b) as string;
  const actions = doc.getMap("actions");
  const odd = ["name", "type", "actor", "description", "instance_id", "input_parameters", "effect"];
  for (const field of odd) actions.set(`${a}|x/${field}`, "7");
  const relations = doc.getMap("relations");
  for (const field of ["parents/conditions", "parents/required", "children/remap", "parents/id"])
    relations.set(`${id}|x/${field}`, "7");
  relations.set(`${id}|x/parents/instance_id`, '"0"');
  doc.getMap("meta").set("x/graph_name", "7");
  rename(doc, a, "New");
  setField(doc, a, "type", "async");
  setField(doc, a, "actor", "robot");
  setField(doc, a, "description", "d");
  addParameter(doc, a, "in", "x", "1");
  setResponse(doc, id, "on_true", "stop");
  setRequired(doc, id, false);
  setRemap(doc, id, "x", "y");
  setGraphName(doc, "g");
  setField(doc, a, "instanceId", 3);
  expect(actionIn(doc, a)?.extra).toEqual([["effect", "7"]]);
  expect(relationIn(doc, id)).toMatchObject({ parentsExtra: [["id", "7"]], childrenExtra: [] });
  expect(graphIn(doc).extra).toEqual([]);
});

// -- parameters, notes ------------------------------------------------------------------------

test("parameters keep their text and their order", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  for (const path of ["z", "a", "m"]) addParameter(doc, a, "in", path, "1.0");
  expect(setParameter(doc, a, "in", "a", () => '{"pvf_value": 5.0}')).toBe(true);
  expect(setParameter(doc, a, "in", "a", () => "{no json")).toBe(false);
  expect(addParameter(doc, a, "in", "a", "1")).toBe(false);
  expect(renameParameter(doc, a, "in", "a", "z")).toBe(false);
  expect(renameParameter(doc, a, "in", "a", "b")).toBe(true);
  expect(removeParameter(doc, a, "in", "z")).toBe(true);
  addParameter(doc, a, "in", "0", "2");
  expect(actionIn(doc, a)?.inputs).toEqual([
    { path: "b", text: '{"pvf_value": 5.0}' },
    { path: "m", text: "1.0" },
    { path: "0", text: "2" },
  ]);
});

test("a change of a parameter keeps what a colleague has changed of it meanwhile", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  addParameter(doc, a, "in", "x", '{"pvf_type": "number"}');
  const ben = copyOf(doc);
  setParameter(ben, a, "in", "x", (now) => now.replace("}", ', "pvf_locked": true}'));
  exchange(doc, ben);
  setParameter(doc, a, "in", "x", (now) => now.replace("}", ', "pvf_value": 1.0}'));
  expect(actionIn(doc, a)?.inputs).toEqual([
    { path: "x", text: '{"pvf_type": "number", "pvf_locked": true, "pvf_value": 1.0}' },
  ]);
});

test("two people who fill in different parameters both keep theirs", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const colleague = copyOf(doc);
  addParameter(doc, a, "in", "mine", "1");
  addParameter(colleague, a, "in", "theirs", "2");
  exchange(doc, colleague);
  expect(
    actionIn(doc, a)
      ?.inputs.map((parameter) => parameter.path)
      .sort(),
  ).toEqual(["mine", "theirs"]);
});

test("notes are added, changed and removed", () => {
  const doc = new Y.Doc();
  const id = addNote(doc, '{"text":"a"}');
  setNote(doc, id, '{"text":"b"}');
  expect(graphIn(doc).notes).toEqual([[id, '{"text":"b"}']]);
  removeNotes(doc, [id]);
  expect(graphIn(doc).notes).toEqual([]);
});

// -- undo -------------------------------------------------------------------------------------

test("an undone delete brings back everything, with what a colleague changed meanwhile", () => {
  const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
  setField(doc, a, "description", "old");
  connect(doc, a, b, "on_error");
  setEntry(doc, a);
  moveActions(doc, [[a, [1, 2]]]);
  const undo = undoOf(doc);
  const before = graphIn(doc);
  const colleague = copyOf(doc);
  removeActions(doc, [a]);
  setField(colleague, a, "description", "new");
  connect(colleague, a, b, "on_true");
  exchange(doc, colleague);
  expect(actionIn(colleague, a)).toBeUndefined();
  undo.undo();
  exchange(doc, colleague);
  const after = graphIn(doc);
  expect(actionIn(doc, a)).toEqual({ ...before.actions[0], description: "new" });
  expect(says(relationIn(doc, `${a}>${b}`))).toEqual(["on_true -> run", "on_error -> run"]);
  expect(arrows(doc)).toEqual(["A>B", "entry>A"]);
  expect(graphIn(colleague)).toEqual(after);
});

test("undo takes back one edit at a time, and only one's own", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const colleague = copyOf(doc);
  const undo = undoOf(doc);
  setField(doc, a, "actor", "mine");
  rename(doc, a, "B");
  setField(colleague, a, "description", "theirs");
  exchange(doc, colleague);
  undo.undo();
  expect(actionIn(doc, a)).toMatchObject({ name: "A", actor: "mine", description: "theirs" });
  undo.undo();
  expect(actionIn(doc, a)).toMatchObject({ name: "A", actor: "", description: "theirs" });
  undo.redo();
  expect(actionIn(doc, a)).toMatchObject({ actor: "mine" });
  expect(undo.undoStack.length).toBe(1);
});

test("undoing an edit does not take back what a colleague wrote over it", () => {
  const [doc, a] = docWith("A") as [Y.Doc, Key];
  const undo = undoOf(doc);
  setField(doc, a, "description", "mine");
  const colleague = copyOf(doc);
  setField(colleague, a, "description", "theirs");
  exchange(doc, colleague);
  undo.undo();
  expect(actionIn(doc, a)?.description).toBe("theirs");
});

// -- people race ------------------------------------------------------------------------------

type Step = readonly [person: number, edit: number, x: number, y: number];

/** Makes one edit, aimed at something that the person sees. */
function act(doc: Y.Doc, undo: UndoHistory, [, edit, x, y]: Step): void {
  const { actions, relations } = graphIn(doc);
  const key = (n: number) => actions[n % Math.max(1, actions.length)]?.key ?? "nobodynobody";
  const relation = relations[x % Math.max(1, relations.length)];
  const id = relation ? relationId(relation) : "";
  const outcome = (["on_true", "on_false", "on_error", "on_stopped"] as const)[y % 4] ?? "on_true";
  const edits: (() => unknown)[] = [
    () => addAction(doc, { name: "ABC".charAt(x % 3) }),
    () => connect(doc, key(x), key(y), outcome),
    () => setEntry(doc, key(x)),
    () => setExit(doc, key(x), outcome),
    () => removeActions(doc, [key(x)], { heal: y % 2 === 0 }),
    () => rename(doc, key(x), "ABC".charAt(y % 3)),
    () => setField(doc, key(x), "instanceId", y % 3),
    () => setField(doc, key(x), "description", `${y}`),
    () => removeRelation(doc, id),
    () => setResponse(doc, id, outcome, "stop"),
    () => moveRelation(doc, id, { child: key(y) }),
    () => insertInto(doc, id, key(y)),
    () => addParameter(doc, key(x), "in", "ABC".charAt(y % 3), "1"),
    () => moveActions(doc, [[key(x), [x, y]]]),
    () => undo.undo(),
    () => undo.redo(),
  ];
  edits[edit % edits.length]?.();
}

test("all see the same graph, with distinct names and existing ends, whatever people do at once", () => {
  const steps = fc.tuple(fc.nat(1), fc.nat(15), fc.nat(5), fc.nat(5));
  fc.assert(
    fc.property(fc.array(fc.array(steps, { maxLength: 8 }), { maxLength: 5 }), (rounds) => {
      const [doc] = docWith("A", "B");
      const people = [doc, copyOf(doc)] as const;
      const undos = people.map(undoOf);
      for (const round of rounds) {
        for (const step of round) {
          const [person] = step;
          act(people[person as 0 | 1], undos[person] as UndoHistory, step);
        }
        exchange(...people);
        const graph = graphIn(people[0]);
        expect(graphIn(people[1])).toEqual(graph);
        expect(new Set(graph.actions.map(fullName)).size).toBe(graph.actions.length);
        const ends = new Set([ENTRY, EXIT, ...graph.actions.map((action) => action.key)]);
        for (const { parent, child } of graph.relations)
          expect(ends.has(parent) && ends.has(child)).toBe(true);
      }
    }),
    { numRuns: 150 },
  );
});

test("undoing everything brings back the beginning", () => {
  const steps = fc.tuple(fc.constant(0), fc.nat(13), fc.nat(5), fc.nat(5));
  fc.assert(
    fc.property(fc.array(steps, { maxLength: 12 }), (script) => {
      const [doc, a, b] = docWith("A", "B") as [Y.Doc, Key, Key];
      connect(doc, a, b);
      const before = graphIn(doc);
      const undo = undoOf(doc);
      for (const step of script) act(doc, undo, step);
      while (undo.canUndo()) undo.undo();
      expect(graphIn(doc)).toEqual(before);
    }),
    { numRuns: 100 },
  );
});

test("turning a graph and laying it out anew is one step of undo", () => {
  const doc = new Y.Doc();
  const key = addAction(doc, { name: "A", position: [0, 100] });
  const undo = undoOf(doc);
  asOneEdit(doc, () => {
    setDirection(doc, "right");
    moveActions(doc, [[key, [200, 0]]]);
  });
  const now = () => readGraph(mapsOf(doc));
  expect([now().direction, now().actions[0]?.position]).toEqual(["right", [200, 0]]);
  undo.undo();
  expect([now().direction, now().actions[0]?.position]).toEqual(["down", [0, 100]]);
  undo.redo();
  setDirection(doc, "down");
  expect(mapsOf(doc).meta.has("direction")).toBe(false);
});

test("elements without a place are written where and as they are drawn, else nothing is", () => {
  const doc = new Y.Doc();
  setDirection(doc, "right");
  const key = addAction(doc, { name: "A" });
  const now = () => readGraph(mapsOf(doc));
  moveLoose(doc, "down", []);
  expect(now().direction).toBe("right");
  moveLoose(doc, "down", [[key, [0, 80]]]);
  expect([now().direction, now().actions[0]?.position]).toEqual(["down", [0, 80]]);
});

test("the first layout of an import is no step of anybody's undo, and no undo takes it along", () => {
  const doc = new Y.Doc();
  const key = addAction(doc, { name: "Drive" });
  const undo = undoOf(doc);
  placeFirst(doc, [[key, [40, 60]]]);
  expect(undo.canUndo()).toBe(false);
  setField(doc, key, "description", "Drives");
  undo.undo();
  expect(actionIn(doc, key)).toMatchObject({ description: "", position: [40, 60] });
  moveActions(doc, [[key, [80, 60]]]);
  undo.undo();
  expect(actionIn(doc, key)?.position).toEqual([40, 60]);
});
