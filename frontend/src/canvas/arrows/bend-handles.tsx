/** Handles by which the line of a chosen arrow is bent: with a mouse, a finger, or keys. */
import { EdgeLabelRenderer, useStore } from "@xyflow/react";
import { type KeyboardEvent, use, useContext, useEffect, useRef } from "react";
import { MOST_WAYPOINTS } from "../../graph/waypoints";
import { keyOf } from "../../ui/keys";
import { type BendHandle, useBendDrag, withBend } from "./bend-drag";
import style from "./bend-handles.module.css";
import { middlesOf } from "./bend-places";
import type { Bundle } from "./bundles";
import { LineContext, type LineEditing, LineEditingContext } from "./line-store";
import { type Point, STEP } from "./scene";
import type { RoutedLine } from "./simple-lines";

const WAYS: Readonly<Record<string, Point>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};
const FAR = 4; // steps with Shift, as of cards
const LEAST = 48; // px on the screen of a piece that has a handle of its own

interface Props {
  /** The arrow that draws the line. */
  arrow: string;
  bundle: Bundle;
  line: RoutedLine;
}

export function BendHandles(props: Props) {
  const editing = use(LineEditingContext);
  return editing && <Handles {...props} editing={editing} />;
}

/** Waypoints first, in their order; then the pieces in which there can be another. */
function handlesOf(line: RoutedLine, zoom: number): BendHandle[] {
  const bends = line.via.map(
    (at, index): BendHandle => ({ id: `b${index}`, kind: "bend", index, at }),
  );
  if (bends.length >= MOST_WAYPOINTS) return bends;
  const middles = middlesOf(line, LEAST / Math.min(1, zoom));
  return [
    ...bends,
    ...middles.map((each, i): BendHandle => ({ id: `m${i}`, kind: "middle", ...each })),
  ];
}

/** Gives the keyboard to a bend once it is there; to the arrow after the last one. */
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

function Handles({ arrow, bundle, line, editing }: Props & { editing: LineEditing }) {
  const lines = useContext(LineContext);
  const zoom = useStore(({ transform }) => transform[2]);
  const { buttons, wanted } = useFocusAfter(line.via.length, arrow);
  // While one is dragged the line goes where it is; the others stay those of before.
  const before = useRef<readonly BendHandle[]>([]);
  const via = before.current.flatMap(({ kind, at }) => (kind === "bend" ? [at] : []));
  const drag = useBendDrag(bundle.id, via, (next, { index }) => {
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
    change(line.via.toSpliced(index, 1), Math.min(index, line.via.length - 2), false);
  const add = (handle: BendHandle, [dx, dy]: Point = [0, 0]) => {
    const at = lines.snapped([handle.at[0] + dx * STEP, handle.at[1] + dy * STEP]);
    change(withBend(line.via, handle, at), handle.index, dx !== 0 || dy !== 0);
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
  const shown = before.current.flatMap((handle) => {
    if (handle.id === dragged?.id) return [dragged];
    return dragged === null || handle.kind === "bend" ? [handle] : [];
  });
  const names = namesOf(shown, editing.nameOf(bundle));
  return (
    <EdgeLabelRenderer>
      {shown.map((handle, i) => (
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
          // A press of Enter or Space has no pointer, hence no clicks to count.
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
