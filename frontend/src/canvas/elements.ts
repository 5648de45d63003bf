/**
 * Turns a graph into nodes and edges of the canvas. Unchanged elements keep their identity, so that
 * they are not rendered again.
 */
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
  type Position,
  type Precondition,
  type Relation,
  type Response,
  spokenOutcomes,
} from "../graph/model";
import { dataFlowOf, type InputGivers } from "../graph/parameters/data-flow";
import {
  type HandOver,
  handOverLabel,
  hasSeveralRobots,
  type RobotOf,
  robotOf,
} from "../graph/robots";
import { movedTogether, movesBetween, shifted } from "../graph/waypoints";
import type { Progress } from "../status/progress";
import { isolated } from "../words/isolated";
import { type Bundle, bundlesOf, type HandOvers, handOversIn, pillSizeOf } from "./arrows/bundles";
import { gridOffset, type Scene, type SceneCard } from "./arrows/scene";
import { expectedCard, expectedEnd } from "./card-handles";
import { cardSize } from "./geometry/arrange";
import { type Positions, pillSize, type Sizes } from "./geometry/ranks";
import { type ProblemMark, type ProblemMarks, problemMarkWords } from "./marks/problem-marks";
import { type FoldedNode, type NoteNode, noteNodes } from "./notes/note-nodes";
import { OUTCOMES, outcomeWord } from "./outcome";

export type CardNode = Node<
  {
    action: Action;
    progress: Progress | null;
    mark: ProblemMark | null;
    /** The colour of another person who has selected it. */
    other: string | null;
    direction: Direction;
    /** The outputs that reach each of its inputs. */
    givers: InputGivers | undefined;
    /** The name of its robot; "" for any robot, and where all actions are one robot's. */
    robot: string;
  },
  "action"
>;
export type EndNode = Node<{ end: "entry" | "exit"; direction: Direction; progress: null }, "end">;
/** Folded frames, and what each of them hides. */
export interface Folding {
  /** Frames that are drawn as one block, by key. */
  readonly blocks: ReadonlyMap<string, Note>;
  /** Hidden elements, each with the block that is drawn instead. */
  readonly blockOf: ReadonlyMap<Key, string>;
  /** The block on which the entry or the exit lies; these two are never hidden. */
  readonly blockUnder: ReadonlyMap<Key, string>;
}

export type CanvasNode = CardNode | EndNode | NoteNode | FoldedNode;

export interface OutcomeResponse {
  readonly outcomes: readonly Precondition[];
  readonly response: Response;
}

export type Arrow = Edge<
  {
    relation: string;
    outcome: Precondition;
    response: Response;
    /** Responses of the whole relation; only its first arrow has them, the others null. */
    answers: readonly OutcomeResponse[] | null;
    /** Problems of the relation; only its first arrow has them. */
    mark: ProblemMark | null;
    /** The line that it shares with the other outcomes of the same response. */
    bundle: Bundle;
    /** True for the first arrow of a bundle, which draws the line and the pill. */
    lead: boolean;
    entry: boolean;
    lit: boolean;
    /** The outcome of this bundle with which the parent's last visit ended; null: none of them. */
    came: Precondition | null;
    /** The parent has ended with an outcome that is not in this bundle. */
    passed: boolean;
    /** Only the other run, which is compared with this one, went this way. */
    ghost?: boolean;
    /** Its two robots, where it leads from an action of one to an action of another. */
    hand: HandOver | null;
    /** True if it starts at a folded frame, which has no handles for single outcomes. */
    portless?: boolean;
  },
  "outcome"
>;

/**
 * Group the outcomes of a relation by response, in the fixed order of outcomes; ignored outcomes
 * are left out.
 */
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
  /** The note with the size that it has while its edges are being dragged. */
  resized?: Note | null;
  /** Sizes of the cards in which a graph is expanded. */
  expanded?: Sizes | undefined;
}

export type ArrowOptions = Pick<NodeOptions, "selected" | "progress" | "marks"> & {
  /** The outcome of each action in another run that is compared with this one. */
  ghosts?: ReadonlyMap<Key, string> | undefined;
};

/** The sides at which arrows leave and enter cards, by direction. */
const SIDES = {
  right: { sourcePosition: Side.Right, targetPosition: Side.Left },
  down: { sourcePosition: Side.Bottom, targetPosition: Side.Top },
} as const;

function place(
  key: Key,
  options: NodeOptions,
  direction: Direction,
  expected: ReturnType<typeof expectedCard>,
) {
  const [x, y] = options.places.get(key) ?? [0, 0];
  const measured = options.measured.get(key) ?? expected.measured;
  const selected = options.selected.has(key);
  return {
    id: key,
    position: { x, y },
    selected,
    zIndex: selected ? 1 : 0,
    ...SIDES[direction],
    measured,
    handles: expected.handles,
  };
}

/** Return the node of an action: the identical `before` if nothing that the card shows has changed. */
function cardOf(
  action: Action,
  { direction, givers, robot }: Pick<CardNode["data"], "direction" | "givers" | "robot">,
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
    givers,
    robot,
  };
  const expected = expectedCard(action, direction, options.expanded?.get(action.key));
  const same =
    before?.type === "action" &&
    before.data.action === action &&
    before.data.progress === data.progress &&
    before.data.mark === data.mark &&
    before.data.other === data.other &&
    before.data.direction === direction &&
    before.data.givers === givers &&
    before.data.robot === robot &&
    before.position.x === x &&
    before.position.y === y &&
    before.selected === options.selected.has(action.key) &&
    before.handles === expected.handles &&
    before.measured === (options.measured.get(action.key) ?? expected.measured);
  if (same) return before;
  const ariaLabel = cardWords(action, robot, options);
  return { ...place(action.key, options, direction, expected), type: "action", ariaLabel, data };
}

/**
 * Return all nodes of a graph in drawing order. `before`: the nodes drawn last, whose unchanged
 * elements are used again.
 */
export function nodesOf(
  graph: Graph,
  options: NodeOptions,
  before: readonly CanvasNode[] = [],
): CanvasNode[] {
  const known = new Map(before.map((node) => [node.id, node]));
  const flow = dataFlowOf(graph);
  const named = hasSeveralRobots(graph.actions);
  const ends = ([ENTRY, EXIT] as const).map(
    (end): EndNode => ({
      ...place(end, options, graph.direction, expectedEnd(end, graph.direction)),
      type: "end",
      ariaLabel: end === ENTRY ? "Entry of the graph" : "Exit of the graph",
      data: { end: end as "entry" | "exit", direction: graph.direction, progress: null },
      deletable: false,
    }),
  );
  const cards = graph.actions.map((action) =>
    cardOf(
      action,
      {
        direction: graph.direction,
        givers: flow.get(action.key),
        robot: named ? action.actor : "",
      },
      options,
      known.get(action.key),
    ),
  );
  const notes = noteNodes(graph, options);
  return [...notes.frames, ...ends, ...cards, ...notes.notes];
}

/** Return whether an arrow has been taken: its parent's last visit ended with this outcome. */
function isLit(relation: Relation, outcome: Precondition, options: ArrowOptions): boolean {
  const parent = options.progress.get(relation.parent);
  if (relation.parent === ENTRY) return options.progress.size > 0;
  return parent !== undefined && `on_${parent.tone}` === outcome;
}

const FARTHEST = 1e7; // px; a file may place a card anywhere
const END_WIDTH = 84; // px of the entry and exit that are visible, in the middle of their box

/** Return the waypoints of a bundle; they move along while both of its ends are dragged by the same way. */
function waypointsOf(bundle: Bundle, moved: Positions): readonly Position[] {
  const { waypoints, source: parent, target: child } = bundle;
  const by = waypoints.length > 0 ? movedTogether({ parent, child }, moved) : null;
  return by ? shifted(waypoints, by) : waypoints;
}

interface SceneOptions extends Pick<NodeOptions, "places" | "measured" | "marks"> {
  /** Places as they are while nothing is dragged. */
  rest?: Positions | undefined;
}

/**
 * Return the input of the router: cards that stand in the way, and the lines to draw. `offset`:
 * that of the previous scene.
 */
export function sceneOf(graph: Graph, options: SceneOptions, offset: number | null): Scene {
  const { direction } = graph;
  const cards: SceneCard[] = [];
  const pill = pillSize(direction);
  const moved = options.rest ? movesBetween(options.rest, options.places) : new Map();
  const put = (key: Key, size: { width: number; height: number }) => {
    const at = options.places.get(key);
    const { width = size.width, height = size.height } = options.measured.get(key) ?? {};
    if (!at?.every((coordinate) => Math.abs(coordinate) < FARTHEST)) return;
    const seen = size === pill ? Math.min(END_WIDTH, width) : width;
    cards.push({ key, x: at[0] + (width - seen) / 2, y: at[1], width: seen, height });
  };
  put(ENTRY, pill);
  for (const action of graph.actions) put(action.key, cardSize(action, direction));
  put(EXIT, pill);
  const handOf = handOversIn(graph.relations, robotOf(graph));
  const lines = graph.relations.flatMap((relation) =>
    bundlesOf(relation).map((bundle, i) => {
      const marked = i === 0 && options.marks.has(bundle.relation);
      const { id, source, target } = bundle;
      return {
        id,
        source,
        target,
        pill: pillSizeOf(bundle, marked, handOf(bundle) !== null),
        waypoints: waypointsOf(bundle, moved),
      };
    }),
  );
  return { direction, offset: gridOffset(cards, direction, offset), cards, lines };
}

function cardWords(action: Action, named: string, { progress, marks }: NodeOptions): string {
  const robot = named === "" ? "" : `, robot ${isolated(named)}`;
  const state = progress.get(action.key)?.word;
  const now = state === undefined ? "" : `, ${state}`;
  const waits = action.breakpoint === undefined ? "" : ", breakpoint";
  return `${isolated(action.name)} ${action.instanceId}${robot}${now}${waits}${problemMarkWords(marks.get(action.key))}`;
}

type Names = ReadonlyMap<Key, string>;

function namesOf(graph: Graph): Names {
  const names = new Map<Key, string>([
    [ENTRY, "entry"],
    [EXIT, "exit"],
  ]);
  for (const { key, name, instanceId } of graph.actions)
    names.set(key, `${isolated(name)} ${instanceId}`);
  return names;
}

function arrowWords(
  relation: Relation,
  outcome: Precondition,
  names: Names,
  hand: HandOver | null,
): string {
  const [from, to] = [names.get(relation.parent) ?? "", names.get(relation.child) ?? ""];
  if (relation.parent === ENTRY) return `Arrow from entry to ${to}`;
  const robots = hand === null ? "" : `; ${handOverLabel(hand)}`;
  const waits = relation.breakpoint === undefined ? "" : ", breakpoint";
  return `Arrow from ${from}, when ${outcomeWord[outcome]}: ${relation.conditions[outcome]} ${to}${robots}${waits}`;
}

/** Names and robots of the cards, which arrows show. Unchanged ones keep the identical object. */
export interface CardSurroundings {
  readonly names: Names;
  readonly robots: RobotOf;
}

/** Return the names and robots of all cards; the identical `before` if none has changed. */
export function surroundingsOf(graph: Graph, before: CardSurroundings | null): CardSurroundings {
  const [names, robots] = [namesOf(graph), robotOf(graph)];
  const same =
    before !== null && alikeMaps(before.names, names) && alikeMaps(before.robots, robots);
  return same ? before : { names, robots };
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
  names: Names,
  handOf: HandOvers,
): Arrow[] {
  const id = relationId(relation);
  const outcomes = spokenOutcomes(relation.conditions);
  const drawn: Precondition[] = outcomes.length > 0 ? outcomes : ["on_true"];
  const entry = relation.parent === ENTRY;
  const mark = options.marks.get(id) ?? null;
  const selected = options.selected.has(id);
  const bundles = bundlesOf(relation);
  const drawnBundles = new Set<string>();
  const ended = `on_${options.progress.get(relation.parent)?.tone}`;
  return drawn.flatMap((outcome, i) => {
    const response = relation.conditions[outcome];
    const bundle = bundles.find((each) => each.response === response);
    if (!bundle) return [];
    const lead = !drawnBundles.has(bundle.id);
    drawnBundles.add(bundle.id);
    const hand = handOf(bundle);
    const came = entry ? null : (bundle.outcomes.find((each) => each === ended) ?? null);
    const other = `on_${options.ghosts?.get(relation.parent)}`;
    const ghost = !entry && came === null && bundle.outcomes.some((each) => each === other);
    const over = !entry && OUTCOMES.some((each) => each === ended);
    return {
      id: `${id}|${outcome}`,
      type: "outcome" as const,
      ariaLabel:
        arrowWords(relation, outcome, names, hand) + problemMarkWords(i === 0 ? mark : null),
      source: relation.parent,
      target: relation.child,
      sourceHandle: entry ? "start" : outcome,
      targetHandle: "in",
      selected,
      // Where several arrows start or end, the selected one lies on top, so that its end can be
      // dragged.
      ...(selected ? { zIndex: 1 } : {}),
      data: {
        ...{ relation: id, outcome, response, bundle, lead, entry, came },
        answers: i === 0 && !entry ? responsesOf(relation) : null,
        mark: i === 0 ? mark : null,
        lit: isLit(relation, outcome, options),
        passed: over && came === null,
        ...(ghost ? { ghost } : {}),
        hand,
      },
    };
  });
}

/** Return one arrow for each outcome with a response, without arrows to missing cards. */
export function edgesOf(
  { relations }: Pick<Graph, "relations">,
  options: ArrowOptions,
  { names, robots }: CardSurroundings,
): Arrow[] {
  const handOf = handOversIn(relations, robots);
  return relations
    .filter(({ parent, child }) => names.has(parent) && names.has(child))
    .flatMap((relation) => arrowsOf(relation, options, names, handOf));
}

/**
 * Return `next`, in which every element that equals one of `before` is replaced by the identical
 * old object.
 */
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
