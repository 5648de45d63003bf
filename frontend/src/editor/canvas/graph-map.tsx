/**
 * The map of the canvas. Dragging on it moves the view, its wheel zooms.
 *
 * React Flow's own map renders one component for each card, and asks each of them after every change.
 */

import { useThrottledValue } from "@mantine/hooks";
import { Panel, type ReactFlowInstance, useStore, type Viewport } from "@xyflow/react";
import { memo, type PointerEvent, type RefObject, useEffect, useMemo, useRef } from "react";
import { type PartOnCard, useEditorStore } from "../../canvas/editor-store";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import { noteColor } from "../../canvas/notes/note-nodes";
import { onMac } from "../../edit-actions/edit-action";
import type { Key } from "../../graph/model";
import { toneColor } from "../../status/state-label";
import { colorOfName } from "../../ui/name-colors";
import { useWatched } from "../../ui/watched";

/** A rectangle in px of the graph. */
interface MapArea {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

interface MapMarks {
  /** Pairs of colour and SVG path, in drawing order. */
  readonly paths: readonly (readonly [color: string, path: string])[];
  /** The box around everything; null while nothing has a size. */
  readonly area: MapArea | null;
}

const MAP_SIZE = { width: 132, height: 92 };
/** The colour of a card with actions drawn on it. */
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

/**
 * Return the paths of all nodes by colour; nodes without a size are left out. `partsOf`: returns
 * the actions drawn on an expanded card.
 */
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

/** Return the visible part of the graph. */
export function seenArea(view: Viewport, size: { width: number; height: number }): MapArea {
  const { x, y, zoom } = view;
  return { x: -x / zoom, y: -y / zoom, width: size.width / zoom, height: size.height / zoom };
}

/** The size of a graph, in screens, up to which it has no map. */
const SCREENS = 1.5;

/**
 * Return whether a map helps: the graph is larger than a screen and a half in a direction, and not all of it is
 * visible. A smaller map would only cover the graph.
 */
export function needsMap(area: MapArea, seen: MapArea): boolean {
  const isWithin =
    area.x >= seen.x &&
    area.y >= seen.y &&
    area.x + area.width <= seen.x + seen.width &&
    area.y + area.height <= seen.y + seen.height;
  const isLarge = area.width > SCREENS * seen.width || area.height > SCREENS * seen.height;
  return isLarge && !isWithin;
}

/** px on screen from the corner of the canvas to the far sides of the map, beside the button of the details. */
const CORNER = { width: MAP_SIZE.width + 68, height: MAP_SIZE.height + 18 };

/** Return whether the map would lie over a card. */
export function coversCard(nodes: readonly CanvasNode[], seen: MapArea, zoom: number): boolean {
  const from = seen.x + seen.width - CORNER.width / zoom;
  const down = seen.y + CORNER.height / zoom;
  return nodes.some((node) => {
    if (node.type === "note") return false;
    const { x, y, width, height } = areaOf(node);
    return x + width > from && x < seen.x + seen.width && y + height > seen.y && y < down;
  });
}

interface MapFrame extends MapArea {
  /** Length in px of the graph that one px of the map stands for. */
  readonly scale: number;
}

/** Return the part of the graph that the map shows: everything, and what is visible, centred. */
export function mapFrame(marks: MapArea | null, seen: MapArea): MapFrame {
  const all = union(marks, seen);
  const scale = Math.max(all.width / MAP_SIZE.width, all.height / MAP_SIZE.height);
  const width = (MAP_SIZE.width + 2 * EDGE) * scale;
  const height = (MAP_SIZE.height + 2 * EDGE) * scale;
  const [x, y] = [all.x + (all.width - width) / 2, all.y + (all.height - height) / 2];
  return { x, y, width, height, scale };
}

const REST = 500; // ms between two updates of the map
const LINE = 25; // px
const PER_PX = 0.002; // zoom steps of factor 2 per px
/** Factor for a pinch on the trackpad of a Mac, which sends smaller wheel events with Ctrl. */
const PINCH = 10;

const Marks = memo(function Marks({ paths }: Pick<ReturnType<typeof mapMarks>, "paths">) {
  return paths.map(([color, path]) => <path key={color} d={path} style={{ fill: color }} />);
});

/**
 * Zooms the canvas by the wheel. React's listeners are passive, hence could not stop the page from
 * scrolling.
 */
function useWheelZoom(
  map: RefObject<SVGSVGElement | null>,
  flow: ReactFlowInstance<CanvasNode, Arrow>,
): void {
  useEffect(() => {
    const { current: svg } = map;
    const onWheel = (event: WheelEvent) => {
      event.preventDefault();
      const px = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 1 : LINE;
      const steps = event.deltaY * px * PER_PX * (event.ctrlKey && onMac ? PINCH : 1);
      void flow.zoomTo(flow.getZoom() * 2 ** -steps);
    };
    svg?.addEventListener("wheel", onWheel, { passive: false });
    return () => svg?.removeEventListener("wheel", onWheel);
  }, [map, flow]);
}

/** Return the event handlers that move the view along with the pointer. */
function useDragging(flow: ReactFlowInstance<CanvasNode, Arrow>, scale: number) {
  const from = useRef<readonly [x: number, y: number] | null>(null);
  const end = () => {
    from.current = null;
  };
  return {
    onPointerDown: (event: PointerEvent<SVGSVGElement>) => {
      if (event.button !== 0) return;
      event.currentTarget.setPointerCapture(event.pointerId);
      from.current = [event.clientX, event.clientY];
    },
    onPointerMove: ({ clientX, clientY }: PointerEvent) => {
      if (from.current === null) return;
      const [x, y] = from.current;
      from.current = [clientX, clientY];
      const view: Viewport = flow.getViewport();
      const step = scale * view.zoom;
      const moved = { x: view.x - (clientX - x) * step, y: view.y - (clientY - y) * step };
      void flow.setViewport({ ...view, ...moved });
    },
    onPointerUp: end,
    onPointerCancel: end,
  };
}

const outline = ({ x, y, width, height }: MapArea) => `M${x},${y}h${width}v${height}h${-width}z`;

interface Props {
  nodes: readonly CanvasNode[];
  flow: ReactFlowInstance<CanvasNode, Arrow>;
  /** True once the person has moved the view: the map may lie over cards then. */
  moved: boolean;
}

export function GraphMap({ nodes, flow, moved }: Props) {
  const map = useRef<SVGSVGElement>(null);
  // Each update computes and paints all paths again.
  const throttled = useThrottledValue(nodes, REST);
  const store = useEditorStore();
  const run = useThrottledValue(useWatched(store.run), REST);
  const expanded = useWatched(store.expanded);
  // biome-ignore lint/correctness/useExhaustiveDependencies: with each change of the run there are other states
  const { paths, area } = useMemo(
    () => mapMarks(throttled, expanded?.partsOf),
    [throttled, expanded, run],
  );
  const [x, y, zoom] = useStore((state) => state.transform);
  const size = {
    width: useStore((state) => state.width),
    height: useStore((state) => state.height),
  };
  const seen = seenArea({ x, y, zoom }, size);
  const frame = mapFrame(area, seen);
  useWheelZoom(map, flow);
  const hands = useDragging(flow, frame.scale);
  const isShown =
    area !== null && needsMap(area, seen) && (moved || !coversCard(throttled, seen, zoom));
  const visibility = isShown ? undefined : "hidden";
  return (
    <Panel position="top-right" className="react-flow__minimap" style={{ ...MAP_SIZE, visibility }}>
      <svg
        ref={map}
        {...hands}
        className="react-flow__minimap-svg"
        style={{ touchAction: "none" }}
        {...MAP_SIZE}
        viewBox={`${frame.x} ${frame.y} ${frame.width} ${frame.height}`}
        role="img"
        aria-label="Map of the canvas"
      >
        <Marks paths={paths} />
        <path
          className="react-flow__minimap-mask"
          d={`${outline(frame)}${outline(seen)}`}
          fillRule="evenodd"
          pointerEvents="none"
        />
      </svg>
    </Panel>
  );
}
