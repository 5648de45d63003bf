/** Folded frames: what each hides, and the nodes, arrows and scene that are drawn instead. Pure. */

import { type NodeHandle, Position as Side } from "@xyflow/react";
import { relationId } from "../../graph/document-keys";
import { inFrame, type Note, notesOf } from "../../graph/edit/notes";
import {
  type Direction,
  ENTRY,
  EXIT,
  type Graph,
  type Key,
  type Relation,
} from "../../graph/model";
import { spokenNote } from "../../graph/note-links";
import type { Progress, Tone } from "../../status/progress";
import { counted } from "../../words/counted";
import { isolated } from "../../words/isolated";
import type { Scene } from "../arrows/scene";
import type { Arrow, CanvasNode, Folding } from "../elements";
import { estimatedSizes } from "../geometry/arrange";
import type { Positions, Sizes } from "../geometry/ranks";
import { type ProblemMark, type ProblemMarks, problemMarkWords } from "../marks/problem-marks";
import type { FoldedNode, FrameBlock, NoteNode, StateCount } from "../notes/note-nodes";
import { OUTCOMES } from "../outcome";

const areaOf = ({ size: [width, height] }: Note) => width * height;

/** Return the frames of a graph. */
export const framesOf = (graph: Graph): Note[] =>
  notesOf(graph).filter(({ kind }) => kind === "frame");

/** Return the size of every element, also of hidden cards, which were never measured. */
export function wholeSizes(graph: Graph, measured: Sizes): Sizes {
  const notes = notesOf(graph).map(
    ({ key, size: [width, height] }) => [key, { width, height }] as const,
  );
  return new Map([...estimatedSizes(graph), ...measured, ...notes]);
}

/**
 * Return what folded frames hide; null if none is folded. Larger frames come first: a frame within
 * a folded frame is hidden, so it hides nothing itself.
 */
export function foldingOf(
  graph: Graph,
  folded: ReadonlySet<string>,
  places: Positions,
  measured: Sizes,
): Folding | null {
  if (folded.size === 0) return null;
  const frames = framesOf(graph).filter(({ key }) => folded.has(key));
  if (frames.length === 0) return null;
  const sizes = wholeSizes(graph, measured);
  const [blocks, blockOf, blockUnder] = [
    new Map<string, Note>(),
    new Map<Key, string>(),
    new Map<Key, string>(),
  ];
  for (const frame of frames.sort((a, b) => areaOf(b) - areaOf(a))) {
    if (blockOf.has(frame.key)) continue;
    blocks.set(frame.key, frame);
    for (const key of inFrame(frame, places, sizes)) {
      const found = key === ENTRY || key === EXIT ? blockUnder : blockOf;
      if (!found.has(key)) found.set(key, frame.key);
    }
  }
  return { blocks, blockOf, blockUnder };
}

/** Return the folded frames that must be unfolded to show these elements. */
export function hiding(
  graph: Graph,
  folded: ReadonlySet<string>,
  keys: readonly Key[],
  places: Positions,
  measured: Sizes,
): string[] {
  const hidden = foldingOf(graph, folded, places, measured)?.blockOf;
  const wanted = keys.filter((key) => hidden?.has(key));
  if (wanted.length === 0) return [];
  const sizes = wholeSizes(graph, measured);
  const around = framesOf(graph).filter((frame) => {
    const inside = folded.has(frame.key) ? new Set(inFrame(frame, places, sizes)) : null;
    return wanted.some((key) => inside?.has(key));
  });
  return around.map(({ key }) => key);
}

/** Return whether an arrow lies within one block. The entry or exit on a block counts as part of it. */
export function isInside({ blockOf, blockUnder }: Folding, { parent, child }: Ends): boolean {
  const of = (key: Key) => blockOf.get(key) ?? blockUnder.get(key);
  return of(parent) !== undefined && of(parent) === of(child);
}

type Ends = Pick<Relation, "parent" | "child">;

/** Tones from the worst to the least important; `unknown` counts as neither running nor over. */
const WORST: readonly Tone[] = [
  "error",
  "unknown",
  "run",
  "stopped",
  "false",
  "true",
  "done",
  "idle",
];

function wordOf({ tone, word }: Progress): string {
  if (tone === "true" || tone === "false" || word === "finished") return "done";
  return word === "waits" ? "waiting" : word;
}

/**
 * Return the number of actions in each state, the worst first. A state whose actions have different
 * results gets a neutral tone.
 */
export function statesOf(progress: readonly Progress[]): StateCount[] {
  const states = new Map<string, StateCount>();
  for (const each of progress) {
    const word = wordOf(each);
    const before = states.get(word);
    const tone = before && before.tone !== each.tone ? "done" : each.tone;
    states.set(word, { word, tone, count: (before?.count ?? 0) + 1 });
  }
  return [...states.values()].sort((a, b) => WORST.indexOf(a.tone) - WORST.indexOf(b.tone));
}

/** Return the sum of several marks; null if there are none. */
function summed(marks: readonly ProblemMark[]): ProblemMark | null {
  if (marks.length === 0) return null;
  const sum = (kind: "wrong" | "fillIn" | "warnings") =>
    marks.reduce((total, mark) => total + mark[kind], 0);
  const reasons = new Set(marks.flatMap((mark) => mark.reasons.split("\n")));
  return {
    wrong: sum("wrong"),
    fillIn: sum("fillIn"),
    warnings: sum("warnings"),
    reasons: [...reasons].join("\n"),
  };
}

/** Return what the block of a folded frame shows of its contents. */
function blockOfFrame(
  folding: Folding,
  frame: string,
  graph: Graph,
  told: { readonly progress: ReadonlyMap<Key, Progress>; readonly marks: ProblemMarks },
): FrameBlock {
  const { blockOf, blockUnder } = folding;
  const actions = graph.actions.filter(({ key }) => blockOf.get(key) === frame);
  const arrows = graph.relations.filter(
    (relation) =>
      isInside(folding, relation) &&
      (blockOf.get(relation.parent) ?? blockUnder.get(relation.parent)) === frame,
  );
  const states = statesOf(actions.flatMap(({ key }) => told.progress.get(key) ?? []));
  const places = [...actions.map(({ key }) => key), ...arrows.map(relationId)];
  return {
    actions: actions.length,
    states,
    tone: states[0]?.tone ?? null,
    mark: summed(places.flatMap((place) => told.marks.get(place) ?? [])),
    direction: graph.direction,
  };
}

interface RunAndProblems {
  readonly progress: ReadonlyMap<Key, Progress>;
  readonly marks: ProblemMarks;
}

const statesWord = ({ states }: FrameBlock) =>
  states.map(({ count, word }) => `${count} ${word}`).join(" · ");

/** Return handles in the middle of the sides, which React Flow needs until it has measured the block. */
function portsOf(width: number, height: number, direction: Direction): NodeHandle[] {
  const right = direction === "right";
  const port = (side: Side, x: number, y: number) => ({
    position: side,
    x,
    y,
    width: 1,
    height: 1,
  });
  const into = right ? port(Side.Left, 0, height / 2) : port(Side.Top, width / 2, 0);
  const out = right ? port(Side.Right, width, height / 2) : port(Side.Bottom, width / 2, height);
  return [
    { ...into, id: "in", type: "target" },
    ...OUTCOMES.map((id): NodeHandle => ({ ...out, id, type: "source" })),
  ];
}

function foldedNode(node: NoteNode, block: FrameBlock): FoldedNode {
  const { id, position, width = 0, height = 0, selected = false, measured } = node;
  const { note } = node.data;
  const says = [counted(block.actions, "action"), statesWord(block)].filter(Boolean).join(": ");
  const name = spokenNote(note.text) || "empty";
  return {
    ...{ id, position, width, height, selected },
    type: "folded",
    ariaLabel: `Frame, ${note.color}, folded: ${isolated(name)}. ${says}${problemMarkWords(block.mark)}`,
    // below Entry and Exit, also while it is selected
    zIndex: 0,
    connectable: false,
    handles: portsOf(width, height, block.direction),
    data: { note, block },
    ...(measured ? { measured } : {}),
  };
}

/** Return the nodes with folded frames as blocks and without what lies in them. */
export function foldedNodes(
  nodes: CanvasNode[],
  folding: Folding | null,
  graph: Graph,
  told: RunAndProblems,
): CanvasNode[] {
  if (folding === null) return nodes;
  return nodes.flatMap((node): CanvasNode[] => {
    if (folding.blockOf.has(node.id)) return [];
    if (node.type !== "note" || !folding.blocks.has(node.id)) return [node];
    return [foldedNode(node, blockOfFrame(folding, node.id, graph, told))];
  });
}

/** Lead arrows into and out of a block to the block itself; their ids stay the same. */
export function foldedArrows(arrows: Arrow[], folding: Folding | null): Arrow[] {
  if (folding === null) return arrows;
  return arrows.flatMap((arrow): Arrow[] => {
    const { source, target, data } = arrow;
    if (isInside(folding, { parent: source, child: target })) return [];
    const [from, to] = [folding.blockOf.get(source), folding.blockOf.get(target)];
    if (!data || (from === undefined && to === undefined)) return [arrow];
    return [
      {
        ...arrow,
        source: from ?? source,
        target: to ?? target,
        // The end at a hidden card cannot be dragged.
        reconnectable: from === undefined ? "source" : to === undefined ? "target" : false,
        data: { ...data, portless: from !== undefined },
      },
    ];
  });
}

/** Return the scene with blocks as obstacles in place of the cards that they hide. */
export function foldedScene(scene: Scene, folding: Folding | null, places: Positions): Scene {
  if (folding === null) return scene;
  const { blocks, blockOf } = folding;
  const cards = scene.cards.filter(({ key }) => !blockOf.has(key));
  for (const { key, at, size } of blocks.values()) {
    const [x, y] = places.get(key) ?? at;
    cards.push({ key, x, y, width: size[0], height: size[1] });
  }
  const lines = scene.lines.flatMap((line) => {
    const { source, target } = line;
    if (isInside(folding, { parent: source, child: target })) return [];
    return [
      { ...line, source: blockOf.get(source) ?? source, target: blockOf.get(target) ?? target },
    ];
  });
  return { ...scene, cards, lines };
}
