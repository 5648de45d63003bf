/** Two moments beside each other, as what two canvases show. Pure. */
import type { ReactFlowInstance } from "@xyflow/react";
import type { ComponentType } from "react";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import { type Positions, positionsOf } from "../../canvas/geometry/arrange";
import type { ChangeMarks } from "../../canvas/marks/change-marks";
import { notePlaces } from "../../canvas/notes/note-nodes";
import type { Graph } from "../../graph/model";
import type { GraphChanges } from "../compare/graph-difference";
import { sideMarks } from "./side-marks";

export interface EarlierCanvasProps {
  readonly side: SideBySide;
  /** The later one, whose view it has. */
  readonly flow: ReactFlowInstance<CanvasNode, Arrow>;
  /** The person has moved the view from here. */
  onPanned(): void;
}

export interface SideBySide {
  readonly before: Graph;
  /** The canvas of the earlier one: loaded with this. */
  readonly Canvas: ComponentType<EarlierCanvasProps>;
  /** On the earlier one, and on the later one. */
  readonly marks: readonly [earlier: ChangeMarks, later: ChangeMarks];
  /** Where everything stands that is seen on one of them. */
  placesWith(later: Positions): Positions;
  /** Which moments these are. */
  readonly words: readonly [earlier: string, later: string];
}

export function sideBySide(
  { before, marks }: GraphChanges,
  words: readonly [earlier: string, later: string],
  Canvas: SideBySide["Canvas"],
): SideBySide {
  const places = new Map([...positionsOf(before), ...notePlaces(before)]);
  let placed: { later: Positions; all: Positions } | null = null;
  return {
    Canvas,
    before,
    marks: [sideMarks(marks, "earlier"), sideMarks(marks, "later")],
    placesWith: (later) => {
      if (placed?.later !== later) placed = { later, all: new Map([...places, ...later]) };
      return placed.all;
    },
    words,
  };
}
