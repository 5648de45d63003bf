/** Handles that bend the line of a selected arrow by mouse, touch or keys. */

import { EdgeLabelRenderer, useReactFlow, useStore } from "@xyflow/react";
import {
  type KeyboardEvent,
  type PointerEvent,
  use,
  useContext,
  useEffect,
  useRef,
  useState,
} from "react";
import { MOST_WAYPOINTS } from "../../graph/waypoints";
import { keyOf } from "../../ui/keys";
import style from "./bend-handles.module.css";
import type { Bundle } from "./bundles";
import { LineContext, type LineEditing, LineEditingContext } from "./line-store";
import { type Point, STEP } from "./scene";
import type { RoutedLine } from "./simple-lines";

/** The middle of a piece. `index`: the place among the waypoints of one that is added there. */
interface PieceMiddle {
  readonly index: number;
  readonly at: Point;
}

const PILL = 24; // px of a line that its pill covers, on either side of its middle

const between = (a: Point, b: Point) => Math.abs(a[0] - b[0]) + Math.abs(a[1] - b[1]);

/** Return the distance of each corner from the start of a line, px. */
function lengthsOf(points: readonly Point[]): number[] {
  let length = 0;
  return points.map((point, i) => {
    length += i === 0 ? 0 : between(points[i - 1] ?? point, point);
    return length;
  });
}

/**
 * Return the distance of a place from the start of a line, at least `from`; null if the line does
 * not pass there.
 */
function placeOn(
  points: readonly Point[],
  lengths: readonly number[],
  place: Point,
  from: number,
): number | null {
  for (let i = 1; i < points.length; i += 1) {
    const [a, b] = [points[i - 1] ?? place, points[i] ?? place];
    const here = (lengths[i - 1] ?? 0) + between(a, place);
    if (between(a, place) + between(place, b) === between(a, b) && here >= from) return here;
  }
  return null;
}

/**
 * Return the middles of the pieces between corners, waypoints and the pill that are at least
 * `least` px long.
 */
export function middlesOf({ points, waypoints, pill }: RoutedLine, least: number): PieceMiddle[] {
  const lengths = lengthsOf(points);
  const [start] = points;
  const first = start && pill ? (placeOn(points, lengths, pill, 0) ?? -PILL) + PILL : 0;
  let passed = first;
  const stops = waypoints.flatMap((place, i) => {
    const at = placeOn(points, lengths, place, passed);
    if (at === null) return [];
    passed = at;
    return [{ at, index: i + 1 }];
  });
  const cuts = [...new Set([first, ...lengths, ...stops.map(({ at }) => at)])]
    .filter((at) => at >= first)
    .sort((a, b) => a - b);
  const pieces = cuts.slice(1).map((end, i) => ({ begin: cuts[i] ?? end, end }));
  const longest = Math.max(...pieces.map(({ begin, end }) => end - begin));
  // A line without waypoints has at least one handle, however short it is.
  const enough = waypoints.length > 0 ? least : Math.min(least, longest);
  return pieces.flatMap(({ begin, end }) => {
    if (end - begin < enough) return [];
    const index = stops.filter(({ at }) => at <= begin).at(-1)?.index ?? 0;
    return [{ index, at: pointAt(points, lengths, (begin + end) / 2) }];
  });
}

function pointAt(points: readonly Point[], lengths: readonly number[], at: number): Point {
  const i = Math.max(
    1,
    lengths.findIndex((length) => length >= at),
  );
  const [a, b] = [points[i - 1] ?? [0, 0], points[i] ?? [0, 0]];
  const [before, after] = [lengths[i - 1] ?? 0, lengths[i] ?? 0];
  const share = after === before ? 0 : (at - before) / (after - before);
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
}

/** A waypoint, or the middle of a piece in which one can be added. */
interface BendHandle {
  readonly id: string;
  readonly kind: "bend" | "middle";
  /** The index among the waypoints. */
  readonly index: number;
  readonly at: Point;
}

const STILL = 3; // px on screen that a press may move without being a drag

/** Return the waypoints with this one added or moved to a place. */
const withBend = (waypoints: readonly Point[], { kind, index }: BendHandle, at: Point): Point[] => [
  ...waypoints.slice(0, index),
  at,
  ...waypoints.slice(kind === "bend" ? index + 1 : index),
];

function useBendDrag(
  bundle: string,
  waypoints: readonly Point[],
  done: (waypoints: Point[], handle: BendHandle) => void,
) {
  const lines = useContext(LineContext);
  const { screenToFlowPosition } = useReactFlow();
  const [dragged, setDragged] = useState<BendHandle | null>(null);
  const press = useRef<Point | null>(null);
  const start = (event: PointerEvent<HTMLElement>) => {
    if (event.button !== 0) return;
    event.currentTarget.setPointerCapture(event.pointerId);
    press.current = [event.clientX, event.clientY];
  };
  const move = ({ clientX: x, clientY: y }: PointerEvent, handle: BendHandle) => {
    if (!press.current) return;
    const [fromX, fromY] = press.current;
    if (dragged === null && Math.hypot(x - fromX, y - fromY) <= STILL) return;
    const to = screenToFlowPosition({ x, y }, { snapToGrid: false });
    const at = lines.snapped([to.x, to.y]);
    setDragged({ ...handle, at });
    lines.dragLine(bundle, withBend(waypoints, handle, at));
  };
  const end = (keep: boolean) => {
    press.current = null;
    if (dragged === null) return;
    setDragged(null);
    if (keep) done(withBend(waypoints, dragged, dragged.at), dragged);
    lines.endDrag(keep);
  };
  return { dragged, start, move, end };
}

const WAYS: Readonly<Record<string, Point>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const FAR = 4; // steps with Shift, as for cards
const LEAST = 48; // px on screen; shorter pieces have no handle

interface BendHandlesProps {
  /** The id of the arrow that draws the line. */
  arrow: string;
  bundle: Bundle;
  line: RoutedLine;
}

export function BendHandles(props: BendHandlesProps) {
  const editing = use(LineEditingContext);
  return editing && <Handles {...props} editing={editing} />;
}

/** Return the handles of the waypoints in their order, then those of the pieces. */
function handlesOf(line: RoutedLine, zoom: number): BendHandle[] {
  const bends = line.waypoints.map(
    (at, index): BendHandle => ({ id: `b${index}`, kind: "bend", index, at }),
  );
  if (bends.length >= MOST_WAYPOINTS) return bends;
  const middles = middlesOf(line, LEAST / Math.min(1, zoom));
  return [
    ...bends,
    ...middles.map((each, i): BendHandle => ({ id: `m${i}`, kind: "middle", ...each })),
  ];
}

/** Moves the focus to a bend once it exists; after the last one is removed, to the arrow. */
function useFocusAfter(count: number, arrow: string) {
  const buttons = useRef(new Map<number, HTMLButtonElement>());
  const wanted = useRef<number | null>(null);
  useEffect(() => {
    const { current } = wanted;
    if (current === null || current >= count) return;
    wanted.current = null;
    const edge = `.react-flow__edge[data-id="${CSS.escape(arrow)}"]`;
    const target = buttons.current.get(current) ?? document.querySelector<SVGElement>(edge);
    target?.focus({ preventScroll: true });
  });
  return { buttons, wanted };
}

function Handles({ arrow, bundle, line, editing }: BendHandlesProps & { editing: LineEditing }) {
  const lines = useContext(LineContext);
  const zoom = useStore(({ transform }) => transform[2]);
  const { buttons, wanted } = useFocusAfter(line.waypoints.length, arrow);
  // During a drag the line follows the pointer, while the other handles stay where they were.
  const before = useRef<readonly BendHandle[]>([]);
  const waypoints = before.current.flatMap(({ kind, at }) => (kind === "bend" ? [at] : []));
  const drag = useBendDrag(bundle.id, waypoints, (next, { index }) => {
    wanted.current = index;
    editing.bend(bundle, next);
  });
  const { dragged } = drag;
  if (dragged === null) before.current = handlesOf(line, zoom);
  const change = (next: readonly Point[], focus: number, byKey: boolean) => {
    wanted.current = focus;
    editing.bend(bundle, next, byKey);
  };
  const remove = ({ index }: BendHandle) =>
    change(line.waypoints.toSpliced(index, 1), Math.min(index, line.waypoints.length - 2), false);
  const add = (handle: BendHandle, [dx, dy]: Point = [0, 0]) => {
    const at = lines.snapped([handle.at[0] + dx * STEP, handle.at[1] + dy * STEP]);
    change(withBend(line.waypoints, handle, at), handle.index, dx !== 0 || dy !== 0);
  };
  const onKeyDown = (event: KeyboardEvent, handle: BendHandle) => {
    const key = keyOf(event);
    const way = WAYS[key];
    const by = event.shiftKey ? FAR : 1;
    const gone = handle.kind === "bend" && ["Delete", "Backspace"].includes(key);
    if (way) add(handle, [way[0] * by, way[1] * by]);
    else if (gone) remove(handle);
    else if (key === "Escape" && dragged) drag.end(false);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const visible = before.current.flatMap((handle) => {
    if (handle.id === dragged?.id) return [dragged];
    return dragged === null || handle.kind === "bend" ? [handle] : [];
  });
  const names = namesOf(visible, editing.nameOf(bundle));
  return (
    <EdgeLabelRenderer>
      {visible.map((handle, i) => (
        <button
          key={handle.id}
          ref={(button) => {
            if (button && handle.kind === "bend") buttons.current.set(handle.index, button);
            else if (handle.kind === "bend") buttons.current.delete(handle.index);
          }}
          type="button"
          className={`${style.handle} nodrag nopan`}
          data-kind={handle.kind}
          data-own-keys
          aria-label={names[i]}
          style={{
            transform: `translate(-50%, -50%) translate(${handle.at[0]}px, ${handle.at[1]}px) scale(${1 / zoom})`,
          }}
          onPointerDown={drag.start}
          onPointerMove={(event) => drag.move(event, handle)}
          onPointerUp={() => drag.end(true)}
          onPointerCancel={() => drag.end(false)}
          onKeyDown={(event) => onKeyDown(event, handle)}
          // A click that Enter or Space causes has a click count of 0.
          onClick={({ detail }) => detail === 0 && handle.kind === "middle" && add(handle)}
          onDoubleClick={() => handle.kind === "bend" && remove(handle)}
        />
      ))}
    </EdgeLabelRenderer>
  );
}

function namesOf(handles: readonly BendHandle[], line: string): string[] {
  const of = (kind: BendHandle["kind"]) => handles.filter((handle) => handle.kind === kind);
  const [bends, middles] = [of("bend"), of("middle")];
  return handles.map((handle) =>
    handle.kind === "bend"
      ? `Bend ${handle.index + 1} of ${bends.length} of the line ${line}`
      : `Bend the line ${line}, piece ${middles.indexOf(handle) + 1} of ${middles.length}`,
  );
}
