/** Handles of the outcomes on the pill of a selected arrow; each outcome can be dragged to another card. */
import { useReactFlow } from "@xyflow/react";
import { type PointerEvent, useEffect, useRef, useState } from "react";
import type { Precondition } from "../graph/model";
import { keyOf } from "../ui/keys";
import type { Bundle } from "./arrows/bundles";
import type { LineEditing } from "./arrows/line-store";
import type { Point } from "./arrows/scene";
import { OutcomeSign, outcomeColor, outcomeWord } from "./outcome";
import style from "./outcome-arrow.module.css";

const STILL = 3; // px on screen that a press may move without being a drag

/** An outcome that is being dragged to another card. */
export interface DraggedOutcome {
  readonly outcome: Precondition;
  /** The place of the pointer, in canvas coordinates. */
  readonly at: Point;
}

interface Dragging {
  bundle: Bundle;
  editing: LineEditing;
  onDrag: (dragged: DraggedOutcome | null) => void;
}

function useOutcomeDrag({ bundle, editing, onDrag }: Dragging) {
  const { screenToFlowPosition } = useReactFlow();
  const press = useRef<Point | null>(null);
  const [dragged, setDragged] = useState<Precondition | null>(null);
  const stop = () => {
    press.current = null;
    setDragged(null);
    onDrag(null);
  };
  useEffect(() => {
    if (dragged === null) return;
    const onKey = (event: KeyboardEvent) => {
      if (keyOf(event) !== "Escape") return;
      event.stopPropagation();
      stop();
    };
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  });
  return {
    dragged,
    stop,
    start: (event: PointerEvent<HTMLElement>) => {
      if (event.button !== 0) return;
      event.currentTarget.setPointerCapture(event.pointerId);
      press.current = [event.clientX, event.clientY];
    },
    move: ({ clientX: x, clientY: y }: PointerEvent, outcome: Precondition) => {
      if (!press.current) return;
      const [fromX, fromY] = press.current;
      if (dragged === null && Math.hypot(x - fromX, y - fromY) <= STILL) return;
      setDragged(outcome);
      const at = screenToFlowPosition({ x, y }, { snapToGrid: false });
      onDrag({ outcome, at: [at.x, at.y] });
    },
    drop: ({ clientX, clientY }: PointerEvent) => {
      const outcome = dragged;
      stop();
      if (outcome !== null) editing.drop(bundle, outcome, [clientX, clientY]);
    },
  };
}

export function OutcomeHandles(props: Parameters<typeof useOutcomeDrag>[0]) {
  const { bundle, editing } = props;
  const drag = useOutcomeDrag(props);
  const line = editing.nameOf(bundle);
  return bundle.outcomes.map((outcome) => (
    <button
      key={outcome}
      type="button"
      className={`${style.handle} nodrag nopan`}
      data-own-keys
      data-dragged={drag.dragged === outcome || undefined}
      aria-label={`Lead “${outcomeWord[outcome]}” of ${line} elsewhere`}
      style={{ color: outcomeColor[outcome] }}
      onPointerDown={drag.start}
      onPointerMove={(event) => drag.move(event, outcome)}
      onPointerUp={drag.drop}
      onPointerCancel={drag.stop}
      // The arrow itself would react to Enter and Space; other keys are shortcuts as everywhere.
      onKeyDown={(event) => {
        if (["Enter", " "].includes(keyOf(event))) event.stopPropagation();
      }}
      onClick={(event) => {
        event.stopPropagation();
        // A click that Enter or Space causes has a click count of 0.
        if (event.detail === 0) editing.choose(bundle, outcome);
      }}
    >
      <OutcomeSign outcome={outcome} size={11} />
    </button>
  ));
}
