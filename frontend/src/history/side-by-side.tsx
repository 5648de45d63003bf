/** The earlier of two moments on a canvas of its own, whose view is that of the later one. */
import {
  type ReactFlowInstance,
  ReactFlowProvider,
  useReactFlow,
  useStoreApi,
} from "@xyflow/react";
import { type ComponentType, useLayoutEffect } from "react";
import type { Arrow, CanvasNode } from "../canvas/elements";
import { positionsOf } from "../canvas/geometry/arrange";
import type { Positions } from "../canvas/geometry/ranks";
import { GraphView } from "../canvas/graph-view";
import { type ChangeMark, ChangeMarked, type ChangeMarks } from "../canvas/marks/change-marks";
import { notePlaces } from "../canvas/notes/note-nodes";
import { useEditorContext } from "../edit-actions/editor-context";
import type { Graph } from "../graph/model";
import type { Progress } from "../status/progress";
import type { GraphChanges } from "./graph-difference";
import style from "./side-by-side.module.css";

const NOTHING: ReadonlyMap<string, Progress> = new Map();

type Store = ReturnType<typeof useStoreApi>;

/** Shows what the other canvas shows, at each frame of its glides, too. */
function LedBy({ store }: { store: Store }) {
  const mine = useStoreApi();
  const { setViewport } = useReactFlow();
  useLayoutEffect(() => {
    const follow = () => {
      const [x, y, zoom] = store.getState().transform;
      const [left, top, size] = mine.getState().transform;
      if (x !== left || y !== top || zoom !== size) void setViewport({ x, y, zoom });
    };
    // Its own pan and zoom are ready some moments after it is drawn.
    const frame = requestAnimationFrame(follow);
    follow();
    const stop = store.subscribe((now, before) => {
      if (now.transform !== before.transform) follow();
    });
    return () => {
      cancelAnimationFrame(frame);
      stop();
    };
  }, [store, mine, setViewport]);
  return null;
}

export function EarlierCanvas({ side, flow, onPanned }: EarlierCanvasProps) {
  const { select, selection } = useEditorContext();
  const store = useStoreApi();
  const { before, marks, words } = side;
  return (
    <>
      <section className={style.earlier} aria-label="Earlier" data-earlier>
        <SideTitle side="Earlier" words={words[0]} />
        <ReactFlowProvider>
          <ChangeMarked marks={marks[0]}>
            <GraphView
              id="earlier"
              graph={before}
              progress={NOTHING}
              selected={selection}
              label="Canvas, earlier"
              onSelect={(key) => select(key === null ? [] : [key])}
              led
              onPanned={(to) => {
                onPanned();
                void flow.setViewport(to);
              }}
            >
              <LedBy store={store} />
            </GraphView>
          </ChangeMarked>
        </ReactFlowProvider>
      </section>
      <SideTitle side="Later" words={words[1]} />
    </>
  );
}

function SideTitle({ side, words }: { side: "Earlier" | "Later"; words: string }) {
  return (
    <p className={style.title} data-side={side}>
      <b>{side}</b> <bdi>{words}</bdi>
    </p>
  );
}

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
  /** Return the positions of all things that are seen on one of the two canvases. */
  placesWith(later: Positions): Positions;
  /** Words for the two moments. */
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

const NO_VALUES: ReadonlyMap<string, string> = new Map();

/**
 * Return the marks of one canvas: added things on the later one, removed ones on the earlier one,
 * changed ones on both.
 */
export function sideMarks(marks: ChangeMarks, side: "earlier" | "later"): ChangeMarks {
  const other: ChangeMark["change"] = side === "earlier" ? "added" : "removed";
  const found = [...marks].flatMap(([key, mark]): [string, ChangeMark][] => {
    if (mark.change === other) return [];
    const rows = new Set(mark.oldValues.keys());
    return [[key, { ...mark, oldName: null, oldValues: NO_VALUES, rows }]];
  });
  return new Map(found);
}
