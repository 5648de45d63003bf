/**
 * The map of the canvas: where everything is, in its colour, and what of it is seen. Dragging it moves
 * the view, its wheel zooms.
 *
 * React Flow's has a component for each card, and asks every one of them after each change of anything.
 */
import { useThrottledValue } from "@mantine/hooks";
import { Panel, type ReactFlowInstance, useStore, type Viewport } from "@xyflow/react";
import {
  memo,
  type PointerEvent,
  type RefObject,
  useEffect,
  useMemo,
  useRef,
  useSyncExternalStore,
} from "react";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import { expandedGraphs } from "../../canvas/graphs-inside";
import { onMac } from "../../edit-actions/edit-action";
import { runOnCanvas } from "../../status/progress-inside";
import { isWithin, MAP_SIZE, type MapArea, mapFrame, mapMarks, seenArea } from "./map-drawing";

const REST = 500; // ms between two drawings of what is on the map
const LINE = 25; // px
const PER_PX = 0.002; // doublings
/** With Ctrl is what a pinch on a trackpad sends, in smaller steps. */
const PINCH = 10;

const Marks = memo(function Marks({ paths }: Pick<ReturnType<typeof mapMarks>, "paths">) {
  return paths.map(([color, path]) => <path key={color} d={path} style={{ fill: color }} />);
});

/** Not by React, whose listeners may not keep the page from scrolling. */
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

/** Hands on the map: what is seen follows the pointer. */
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
}

export function GraphMap({ nodes, flow }: Props) {
  const map = useRef<SVGSVGElement>(null);
  // Each change of anything makes all paths again, and has them painted.
  const shown = useThrottledValue(nodes, REST);
  const run = useThrottledValue(useSyncExternalStore(runOnCanvas.subscribe, runOnCanvas.now), REST);
  const expanded = useSyncExternalStore(expandedGraphs.subscribe, expandedGraphs.now);
  // biome-ignore lint/correctness/useExhaustiveDependencies: with each change of the run there are other states
  const { paths, area } = useMemo(() => mapMarks(shown, expanded?.partsOf), [shown, expanded, run]);
  const [x, y, zoom] = useStore((state) => state.transform);
  const size = {
    width: useStore((state) => state.width),
    height: useStore((state) => state.height),
  };
  const seen = seenArea({ x, y, zoom }, size);
  const frame = mapFrame(area, seen);
  useWheelZoom(map, flow);
  const hands = useDragging(flow, frame.scale);
  // Where all is seen it tells nothing, and would lie on what it tells of.
  const visibility = area === null || isWithin(area, seen) ? "hidden" : undefined;
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
