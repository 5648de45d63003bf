/** Nodes, arrows and scene of a graph as they are drawn while frames are folded. Pure. */
import { type NodeHandle, Position as Side } from "@xyflow/react";
import type { Direction, Graph, Key } from "../../graph/model";
import { spokenNote } from "../../graph/note-links";
import type { Progress } from "../../status/progress";
import { isolated } from "../../words/isolated";
import type { Scene } from "../arrows/scene";
import type { Arrow, CanvasNode } from "../elements";
import type { Positions } from "../geometry/arrange";
import type { FoldedNode, FrameBlock, NoteNode } from "../notes/note-nodes";
import { OUTCOMES } from "../outcome";
import { type ProblemMarks, problemMarkWords } from "../problem-marks";
import { blockOfFrame, type Folding, isInside } from "./folding";

interface RunAndProblems {
  readonly progress: ReadonlyMap<Key, Progress>;
  readonly marks: ProblemMarks;
}

export const actionsWord = (count: number) => (count === 1 ? "1 action" : `${count} actions`);

const statesWord = ({ states }: FrameBlock) =>
  states.map(({ count, word }) => `${count} ${word}`).join(" · ");

/** In the middle of its sides, until it is measured: where lines begin and end the router says. */
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
  const says = [actionsWord(block.actions), statesWord(block)].filter(Boolean).join(": ");
  const name = spokenNote(note.text) || "empty";
  return {
    ...{ id, position, width, height, selected },
    type: "folded",
    ariaLabel: `Frame, ${note.color}, folded: ${isolated(name)}. ${says}${problemMarkWords(block.mark)}`,
    // Entry and Exit are seen on it also while it is chosen.
    zIndex: 0,
    connectable: false,
    handles: portsOf(width, height, block.direction),
    data: { note, block },
    ...(measured ? { measured } : {}),
  };
}

/** Folded frames as blocks, and nothing of what lies in them. */
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

/** What leads into a block or out of it ends or begins there; it stays the arrow that it is. */
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
        // What is not seen cannot be taken and led elsewhere.
        reconnectable: from === undefined ? "source" : to === undefined ? "target" : false,
        data: { ...data, portless: from !== undefined },
      },
    ];
  });
}

/** Lines run round blocks, and through what these hide. */
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
