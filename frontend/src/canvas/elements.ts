/** A graph as nodes and edges of the canvas; what did not change keeps its identity. */
import { type Edge, type Node, Position as Side } from "@xyflow/react";
import { relationId } from "../graph/document-keys";
import type { Note } from "../graph/edit/notes";
import {
  type Action,
  type Direction,
  ENTRY,
  EXIT,
  type Graph,
  type Key,
  type Precondition,
  type Relation,
  type Response,
  spokenOutcomes,
} from "../graph/model";
import type { Progress } from "../status/progress";
import { CARD, PILL, type Positions } from "./geometry/arrange";
import { laneBack, laneFor, MOST_CARDS, type Rectangle } from "./geometry/detours";
import {
  alongCurve,
  alongLane,
  anchorOf,
  type LabelRequest,
  placeLabels,
  sizeOf,
} from "./geometry/label-places";
import { type NoteNode, noteNodes } from "./notes/note-nodes";
import { OUTCOMES, outcomeWord } from "./outcome";
import { type ProblemMark, type ProblemMarks, problemMarkWords } from "./problem-marks";

export type CardNode = Node<
  {
    action: Action;
    progress: Progress | null;
    mark: ProblemMark | null;
    /** The colour of somebody else who has it selected. */
    other: string | null;
    direction: Direction;
  },
  "action"
>;
export type EndNode = Node<{ end: "entry" | "exit"; direction: Direction; progress: null }, "end">;
export type CanvasNode = CardNode | EndNode | NoteNode;

export interface OutcomeResponse {
  readonly outcomes: readonly Precondition[];
  readonly response: Response;
}

export type Arrow = Edge<
  {
    relation: string;
    outcome: Precondition;
    response: Response;
    /** What the whole relation says; only the first arrow of a relation carries the label. */
    answers: readonly OutcomeResponse[] | null;
    /** What is wrong with the relation; on its first arrow. */
    mark: ProblemMark | null;
    optional: boolean;
    lead: boolean;
    /** The x of the lane on which it goes round cards; null: straight down. */
    lane: number | null;
    entry: boolean;
    lit: boolean;
    /** Where the label stands; null: in the middle of the way. */
    label: ArrowLabel | null;
  },
  "outcome"
>;

interface ArrowLabel {
  readonly x: number;
  readonly y: number;
  readonly anchor: LabelRequest["anchor"];
}

/** The outcomes that get the same response, together, in the fixed order of outcomes. */
export function responsesOf(relation: Relation): OutcomeResponse[] {
  const answers: { outcomes: Precondition[]; response: Response }[] = [];
  for (const outcome of OUTCOMES) {
    const response = relation.conditions[outcome];
    if (response === "ignore") continue;
    const known = answers.find((answer) => answer.response === response);
    if (known) known.outcomes.push(outcome);
    else answers.push({ outcomes: [outcome], response });
  }
  return answers;
}

export interface NodeOptions {
  places: Positions;
  selected: ReadonlySet<string>;
  progress: ReadonlyMap<Key, Progress>;
  marks: ProblemMarks;
  others?: ReadonlyMap<Key, string>;
  measured: ReadonlyMap<Key, { width?: number; height?: number }>;
  /** A note as it is while somebody drags its edges. */
  resized?: Note | null;
}

export type ArrowOptions = Pick<NodeOptions, "selected" | "progress" | "marks">;

/** On which sides arrows leave and arrive. */
const SIDES = {
  right: { sourcePosition: Side.Right, targetPosition: Side.Left },
  down: { sourcePosition: Side.Bottom, targetPosition: Side.Top },
} as const;

function place(key: Key, options: NodeOptions, direction: Direction) {
  const [x, y] = options.places.get(key) ?? [0, 0];
  const measured = options.measured.get(key);
  const selected = options.selected.has(key);
  return {
    id: key,
    position: { x, y },
    selected,
    zIndex: selected ? 1 : 0,
    ...SIDES[direction],
    ...(measured ? { measured } : {}),
  };
}

/** The card of an action: the same as before when nothing that it shows has changed. */
function cardOf(
  action: Action,
  direction: Direction,
  options: NodeOptions,
  before: CanvasNode | undefined,
): CardNode {
  const [x, y] = options.places.get(action.key) ?? [0, 0];
  const data = {
    action,
    progress: options.progress.get(action.key) ?? null,
    mark: options.marks.get(action.key) ?? null,
    other: options.others?.get(action.key) ?? null,
    direction,
  };
  const same =
    before?.type === "action" &&
    before.data.action === action &&
    before.data.progress === data.progress &&
    before.data.mark === data.mark &&
    before.data.other === data.other &&
    before.data.direction === direction &&
    before.position.x === x &&
    before.position.y === y &&
    before.selected === options.selected.has(action.key) &&
    before.measured === options.measured.get(action.key);
  if (same) return before;
  const ariaLabel = cardWords(action, options);
  return { ...place(action.key, options, direction), type: "action", ariaLabel, data };
}

/** `before`: what was drawn last; it is looked at first, since of many cards few change at once. */
export function nodesOf(
  graph: Graph,
  options: NodeOptions,
  before: readonly CanvasNode[] = [],
): CanvasNode[] {
  const known = new Map(before.map((node) => [node.id, node]));
  const ends = ([ENTRY, EXIT] as const).map(
    (end): EndNode => ({
      ...place(end, options, graph.direction),
      type: "end",
      ariaLabel: end === ENTRY ? "Entry of the graph" : "Exit of the graph",
      data: { end: end as "entry" | "exit", direction: graph.direction, progress: null },
      deletable: false,
    }),
  );
  const cards = graph.actions.map((action) =>
    cardOf(action, graph.direction, options, known.get(action.key)),
  );
  const notes = noteNodes(graph, options);
  return [...notes.frames, ...ends, ...cards, ...notes.notes];
}

/** Whether the arrow has been taken: its parent ended this way in its last visit. */
function isLit(relation: Relation, outcome: Precondition, options: ArrowOptions): boolean {
  const parent = options.progress.get(relation.parent);
  if (relation.parent === ENTRY) return options.progress.size > 0;
  return parent !== undefined && `on_${parent.tone}` === outcome;
}

/**
 * Where cards stand. Empty when there are too many to look for ways round them, and from left to
 * right, where arrows go straight.
 */
function boxesOf(graph: Graph, options: NodeOptions): Map<Key, Rectangle> {
  const boxes = new Map<Key, Rectangle>();
  if (graph.actions.length > MOST_CARDS || graph.direction === "right") return boxes;
  const put = (key: Key, size: { width: number; height: number }) => {
    const at = options.places.get(key);
    const { width = size.width, height = size.height } = options.measured.get(key) ?? {};
    if (at) boxes.set(key, { x: at[0], y: at[1], width, height });
  };
  for (const { key } of graph.actions) put(key, CARD);
  put(ENTRY, PILL);
  put(EXIT, PILL);
  return boxes;
}

/** Where on the lower edge of a card an arrow begins, from its left. */
export function outcomeOffset(entry: boolean, outcome: Precondition): number {
  return entry ? 0.5 : 0.14 + 0.24 * OUTCOMES.indexOf(outcome);
}

const LANE_WIDTH = 9; // px between the lanes of one relation's outcomes

function laneOf(
  relation: Relation,
  outcome: Precondition,
  boxes: Map<Key, Rectangle>,
): number | null {
  const from = boxes.get(relation.parent);
  const to = boxes.get(relation.child);
  if (!from || !to || relation.parent === relation.child) return null;
  const at = OUTCOMES.indexOf(outcome);
  const share = outcomeOffset(relation.parent === ENTRY, outcome);
  const start = { x: from.x + from.width * share, y: from.y + from.height };
  const others = [...boxes]
    .filter(([key]) => key !== relation.parent && key !== relation.child)
    .map(([, box]) => box);
  if (to.y < start.y + 10) return laneBack(from, to, others) - LANE_WIDTH * at;
  const lane = laneFor(start, { x: to.x + to.width / 2, y: to.y }, others);
  if (lane === null) return null;
  return lane + Math.sign(lane - to.x) * LANE_WIDTH * at;
}

function cardWords(action: Action, { progress, marks }: NodeOptions): string {
  const robot = action.actor === "" ? "" : `, robot ${action.actor}`;
  const state = progress.get(action.key)?.word;
  const now = state === undefined ? "" : `, ${state}`;
  return `${action.name} ${action.instanceId}${robot}${now}${problemMarkWords(marks.get(action.key))}`;
}

type Names = ReadonlyMap<Key, string>;

function namesOf(graph: Graph): Names {
  const names = new Map<Key, string>([
    [ENTRY, "entry"],
    [EXIT, "exit"],
  ]);
  for (const { key, name, instanceId } of graph.actions) names.set(key, `${name} ${instanceId}`);
  return names;
}

function arrowWords(relation: Relation, outcome: Precondition, names: Names): string {
  const [from, to] = [names.get(relation.parent) ?? "", names.get(relation.child) ?? ""];
  if (relation.parent === ENTRY) return `Arrow from entry to ${to}`;
  return `Arrow from ${from}, when ${outcomeWord[outcome]}: ${relation.conditions[outcome]} ${to}`;
}

/** What arrows have to know of cards: the same as before when it says the same. */
export interface CardSurroundings {
  readonly boxes: Map<Key, Rectangle>;
  readonly names: Names;
}

export function surroundingsOf(
  graph: Graph,
  options: NodeOptions,
  before: CardSurroundings | null,
): CardSurroundings {
  const names = namesOf(graph);
  const boxes = boxesOf(graph, options);
  const same = before !== null && alikeMaps(before.names, names) && alikeMaps(before.boxes, boxes);
  return same ? before : { boxes, names };
}

function alikeMaps<T>(a: ReadonlyMap<Key, T>, b: ReadonlyMap<Key, T>): boolean {
  if (a.size !== b.size) return false;
  for (const [key, value] of b) {
    const known = a.get(key);
    if (known !== value && !(isPlain(known) && isPlain(value) && alike(known, value))) return false;
  }
  return true;
}

function arrowsOf(
  relation: Relation,
  options: ArrowOptions,
  { boxes, names }: CardSurroundings,
): Arrow[] {
  const id = relationId(relation);
  const outcomes = spokenOutcomes(relation.conditions);
  const shown: Precondition[] = outcomes.length > 0 ? outcomes : ["on_true"];
  const entry = relation.parent === ENTRY;
  const mark = options.marks.get(id) ?? null;
  const selected = options.selected.has(id);
  return shown.map((outcome, i) => ({
    id: `${id}|${outcome}`,
    type: "outcome",
    ariaLabel: arrowWords(relation, outcome, names) + problemMarkWords(i === 0 ? mark : null),
    source: relation.parent,
    target: relation.child,
    sourceHandle: entry ? "start" : outcome,
    targetHandle: "in",
    selected,
    // Where several begin or end, the chosen one is the one whose end can be taken.
    ...(selected ? { zIndex: 1 } : {}),
    data: {
      relation: id,
      outcome,
      response: relation.conditions[outcome],
      answers: i === 0 && !entry ? responsesOf(relation) : null,
      mark: i === 0 ? mark : null,
      optional: !relation.required,
      lead: i === 0,
      lane: laneOf(relation, outcome, boxes),
      entry,
      lit: isLit(relation, outcome, options),
      label: null,
    },
  }));
}

export function edgesOf(
  { relations }: Pick<Graph, "relations">,
  options: ArrowOptions,
  around: CardSurroundings,
): Arrow[] {
  const arrows = relations
    .filter(({ parent, child }) => around.names.has(parent) && around.names.has(child))
    .flatMap((relation) => arrowsOf(relation, options, around));
  return labelled(arrows, around.boxes);
}

/** The same arrows with places for their labels. */
function labelled(arrows: Arrow[], boxes: Map<Key, Rectangle>): Arrow[] {
  const wishes = arrows.flatMap((arrow) => wishOf(arrow, arrows, boxes) ?? []);
  const places = placeLabels(wishes, [...boxes.values()]);
  const anchors = new Map(wishes.map(({ id, anchor }) => [id, anchor]));
  return arrows.map((arrow) => {
    const at = places.get(arrow.id);
    const anchor = anchors.get(arrow.id);
    if (!at || !anchor || !arrow.data) return arrow;
    const label = { x: Math.round(at.x), y: Math.round(at.y), anchor };
    return { ...arrow, data: { ...arrow.data, label } };
  });
}

function wishOf(
  arrow: Arrow,
  arrows: readonly Arrow[],
  boxes: Map<Key, Rectangle>,
): LabelRequest | null {
  const { data, source, target } = arrow;
  const [from, to] = [boxes.get(source), boxes.get(target)];
  if (!data || (!data.answers && !data.mark) || !from || !to || source === target) return null;
  const optional = data.optional ? " · optional" : "";
  const lines = (data.answers ?? []).map(({ outcomes, response }) => ({
    text: `${outcomes.map((outcome) => outcomeWord[outcome]).join(" ")} → ${response}${optional}`,
    signs: outcomes.length,
  }));
  const size = sizeOf(lines);
  const wide = data.mark ? { ...size, width: size.width + 34 } : size;
  // The label speaks for all arrows of its relation: it stands between them.
  const shares = arrows
    .filter((other) => other.data?.relation === data.relation && other.data.lane === null)
    .map((other) => outcomeOffset(other.data?.entry === true, other.data?.outcome ?? "on_true"));
  const lead = outcomeOffset(data.entry, data.outcome);
  const mean = shares.reduce((sum, share) => sum + share, 0) / Math.max(1, shares.length);
  const start = {
    x: from.x + from.width * (data.lane === null ? mean : lead),
    y: from.y + from.height,
  };
  const end = { x: to.x + to.width / 2, y: to.y };
  if (data.lane === null) {
    if (end.y < start.y + 8) return null;
    return { id: arrow.id, ...wide, anchor: "middle", points: alongCurve(start, end) };
  }
  const down = end.y > start.y;
  const points = down
    ? alongLane(data.lane, start.y + 30, end.y - 30)
    : alongLane(data.lane, start.y + 20, end.y - 20);
  return { id: arrow.id, ...wide, anchor: anchorOf(data.lane, start.x, end.x), points };
}

/** `next`, with every element of `before` that says the same in its place. */
export function keepEqual<T extends { id: string; data?: object }>(
  before: readonly T[],
  next: T[],
): T[] {
  const old = new Map(before.map((item) => [item.id, item]));
  let changed = before.length !== next.length;
  const kept = next.map((item, i) => {
    const known = old.get(item.id);
    const same = known !== undefined && (known === item || alike(known, item));
    if (!same || before[i] !== known) changed = true;
    return same ? known : item;
  });
  return changed ? kept : (before as T[]);
}

function alike(a: object, b: object): boolean {
  const keys = Object.keys(a);
  if (keys.length !== Object.keys(b).length) return false;
  return keys.every((key) => {
    const [x, y] = [(a as Record<string, unknown>)[key], (b as Record<string, unknown>)[key]];
    if (Object.is(x, y)) return true;
    return isPlain(x) && isPlain(y) && alike(x, y);
  });
}

function isPlain(value: unknown): value is object {
  return typeof value === "object" && value !== null;
}
