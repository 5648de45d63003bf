/** Dragging one outcome off the pill of a chosen arrow, to another card. */
import { useReactFlow } from "@xyflow/react";
import { type PointerEvent, useEffect, useRef, useState } from "react";
import type { Precondition } from "../../graph/model";
import { keyOf } from "../../ui/keys";
import type { Bundle } from "./bundles";
import type { LineEditing } from "./line-store";
import type { Point } from "./scene";

const STILL = 3; // px on the screen that a press may move

/** An outcome on its way to another card. */
export interface DraggedOutcome {
  readonly outcome: Precondition;
  /** On the canvas. */
  readonly at: Point;
}

interface Dragging {
  bundle: Bundle;
  editing: LineEditing;
  onDrag: (dragged: DraggedOutcome | null) => void;
}

export function useOutcomeDrag({ bundle, editing, onDrag }: Dragging) {
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
