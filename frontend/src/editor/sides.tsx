/** Two moments beside each other: what the canvas shows then, and the other canvas. */
import { type ReactFlowInstance, useStoreApi } from "@xyflow/react";
import { type ReactNode, useMemo } from "react";
import { type ChangeMarks, ChangeMarksContext } from "../canvas/changes/change-marks";
import type { Arrow, CanvasNode } from "../canvas/elements";
import { type Positions, positionsOf, type Sizes } from "../canvas/geometry/arrange";
import { notePlaces } from "../canvas/notes/note-nodes";
import type { GraphChanges } from "../past/compare/graph-difference";
import { sideMarks } from "../past/side/side-marks";
import { SideTitle } from "../past/side/side-title";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";
import type { Past } from "./use-past";

const EarlierCanvas = lazyPart(() =>
  import("../past/side/earlier-canvas").then((part) => part.EarlierCanvas),
);

interface SideBySide {
  readonly changes: GraphChanges;
  readonly words: readonly [earlier: string, later: string];
}

/** The two moments that stand beside each other; null where one canvas shows all. */
function useSide({ place, side, seen }: Past): SideBySide | null {
  return useMemo(() => {
    const changes = seen?.changes ?? null;
    if (place === null || !side || seen === null || changes === null) return null;
    return { changes, words: seen.words };
  }, [place, side, seen]);
}

function useShownMarks({ seen }: Past, side: SideBySide | null): ChangeMarks | null {
  const marks = seen?.changes?.marks ?? null;
  return useMemo(
    () => (side === null || marks === null ? marks : sideMarks(marks, "later")),
    [side, marks],
  );
}

/** Where everything stands that is seen on one of the canvases. */
function useSeenPlaces(places: Positions, sizes: Sizes, side: SideBySide | null): Positions {
  return useMemo(() => {
    if (side === null) return places;
    const { before } = side.changes;
    return new Map([...positionsOf(before, sizes), ...notePlaces(before), ...places]);
  }, [places, sizes, side]);
}

/** What the canvas shows of two moments, and where everything stands that is seen of them. */
export function useSides(past: Past, { places, sizes }: { places: Positions; sizes: Sizes }) {
  const side = useSide(past);
  const marks = useShownMarks(past, side);
  return { side, small: side !== null, marks, places: useSeenPlaces(places, sizes, side) };
}

interface LaterProps {
  side: SideBySide | null;
  marks: ChangeMarks | null;
  children: ReactNode;
}

/** What is drawn on the canvas, with what differs marked on it. */
export function LaterSide({ side, marks, children }: LaterProps) {
  return (
    <>
      {side && <SideTitle side="Later" words={side.words[1]} />}
      <ChangeMarksContext value={marks}>{children}</ChangeMarksContext>
    </>
  );
}

interface EarlierProps {
  side: SideBySide;
  flow: ReactFlowInstance<CanvasNode, Arrow>;
  onPanned: () => void;
}

export function EarlierSide({ side, flow, onPanned }: EarlierProps) {
  const store = useStoreApi();
  return (
    <PartBoundary>
      <EarlierCanvas
        changes={side.changes}
        words={side.words[0]}
        store={store}
        onPanned={(to) => {
          onPanned();
          void flow.setViewport(to);
        }}
      />
    </PartBoundary>
  );
}
