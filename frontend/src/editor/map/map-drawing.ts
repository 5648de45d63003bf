/** The map of the canvas as paths: one for each colour, and what part of the graph the map shows. */
import type { Viewport } from "@xyflow/react";
import type { CanvasNode } from "../../canvas/elements";
import type { PartOnCard } from "../../canvas/graphs-inside";
import { noteColor } from "../../canvas/notes/note-nodes";
import type { Key } from "../../graph/model";
import { toneColor } from "../../status/state-label";
import { colorOfName } from "../../ui/name-colors";

/** In px of the graph. */
export interface MapArea {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

interface MapMarks {
  /** Colour and path, the lowest first. */
  readonly paths: readonly (readonly [color: string, path: string])[];
  /** Null while nothing has a size. */
  readonly area: MapArea | null;
}

export const MAP_SIZE = { width: 132, height: 92 };
/** Of a card on which others are seen. */
const BEHIND = "color-mix(in srgb, var(--line2) 40%, transparent)";
const ROUND = 10; // px of the graph
const EDGE = 5; // px of the map

function markColor(node: CanvasNode): string {
  const folded = node.type === "folded";
  if (node.type === "note" || (folded && (node.data.block.tone ?? "idle") === "idle")) {
    const part = !folded && node.data.note.kind === "frame" ? 18 : 60;
    return `color-mix(in srgb, ${noteColor[node.data.note.color]} ${part}%, transparent)`;
  }
  const tone = (node.type === "folded" ? node.data.block : node.data.progress)?.tone ?? "idle";
  if (tone !== "idle") return toneColor[tone];
  const robot = node.type === "action" ? node.data.action.actor : "";
  return robot === "" ? "var(--line2)" : colorOfName(robot);
}

function areaOf({ position, measured, width, height }: CanvasNode): MapArea {
  const size = { width: measured?.width ?? width ?? 0, height: measured?.height ?? height ?? 0 };
  return { ...position, ...size };
}

function union(a: MapArea | null, b: MapArea): MapArea {
  if (a === null) return b;
  const [x, y] = [Math.min(a.x, b.x), Math.min(a.y, b.y)];
  const width = Math.max(a.x + a.width, b.x + b.width) - x;
  return { x, y, width, height: Math.max(a.y + a.height, b.y + b.height) - y };
}

function rectangle({ x, y, width, height }: MapArea): string {
  const r = Math.min(ROUND, width / 2, height / 2);
  const [across, down] = [width - 2 * r, height - 2 * r];
  const turn = (dx: number, dy: number) => `a${r},${r} 0 0 1 ${dx},${dy}`;
  const right = `h${across}${turn(r, r)}v${down}${turn(-r, r)}`;
  return `M${x + r},${y}${right}h${-across}${turn(-r, -r)}v${-down}${turn(r, -r)}z`;
}

const partColor = ({ progress, action: { actor } }: PartOnCard): string =>
  progress && progress.tone !== "idle"
    ? toneColor[progress.tone]
    : actor === ""
      ? "var(--line2)"
      : colorOfName(actor);

/** What nothing is known of the size of is left out. `partsOf`: what is drawn on a card that is expanded. */
export function mapMarks(
  nodes: readonly CanvasNode[],
  partsOf: (key: Key) => readonly PartOnCard[] = () => [],
): MapMarks {
  const paths = new Map<string, string>();
  let area: MapArea | null = null;
  for (const node of nodes) {
    const own = areaOf(node);
    if (own.width === 0 || own.height === 0) continue;
    const parts = partsOf(node.id);
    const put = (color: string, at: MapArea) =>
      paths.set(color, (paths.get(color) ?? "") + rectangle(at));
    put(parts.length > 0 ? BEHIND : markColor(node), own);
    for (const part of parts)
      if (!part.expanded) put(partColor(part), { ...part, x: own.x + part.x, y: own.y + part.y });
    area = union(area, own);
  }
  return { paths: [...paths], area };
}

/** What is seen of the graph. */
export function seenArea(view: Viewport, size: { width: number; height: number }): MapArea {
  const { x, y, zoom } = view;
  return { x: -x / zoom, y: -y / zoom, width: size.width / zoom, height: size.height / zoom };
}

/** Whether all of an area is seen. */
export function isWithin(area: MapArea, seen: MapArea): boolean {
  return (
    area.x >= seen.x &&
    area.y >= seen.y &&
    area.x + area.width <= seen.x + seen.width &&
    area.y + area.height <= seen.y + seen.height
  );
}

interface MapFrame extends MapArea {
  /** Px of the graph in one of the map. */
  readonly scale: number;
}

/** All of the graph and what is seen, in the middle of the map. */
export function mapFrame(marks: MapArea | null, seen: MapArea): MapFrame {
  const all = union(marks, seen);
  const scale = Math.max(all.width / MAP_SIZE.width, all.height / MAP_SIZE.height);
  const width = (MAP_SIZE.width + 2 * EDGE) * scale;
  const height = (MAP_SIZE.height + 2 * EDGE) * scale;
  const [x, y] = [all.x + (all.width - width) / 2, all.y + (all.height - height) / 2];
  return { x, y, width, height, scale };
}
