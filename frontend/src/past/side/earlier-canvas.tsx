/** The earlier of two moments on a canvas of its own, whose view is that of the later one. */
import { ReactFlowProvider, useReactFlow, useStoreApi, type Viewport } from "@xyflow/react";
import { useLayoutEffect, useMemo } from "react";
import { ChangeMarksContext } from "../../canvas/changes/change-marks";
import { GraphView } from "../../canvas/graph-view";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { Progress } from "../../status/progress";
import type { GraphChanges } from "../compare/graph-difference";
import style from "./side.module.css";
import { sideMarks } from "./side-marks";
import { SideTitle } from "./side-title";

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

interface Props {
  changes: GraphChanges;
  /** Which moment it is. */
  words: string;
  /** Whose view it has. */
  store: Store;
  /** The person has moved the view from here. */
  onPanned: (to: Viewport) => void;
}

export function EarlierCanvas({ changes, words, store, onPanned }: Props) {
  const { select, selection } = useEditorContext();
  const { before, marks } = changes;
  const mine = useMemo(() => sideMarks(marks, "earlier"), [marks]);
  return (
    <section className={style.earlier} aria-label="Earlier" data-earlier>
      <SideTitle side="Earlier" words={words} />
      <ReactFlowProvider>
        <ChangeMarksContext value={mine}>
          <GraphView
            id="earlier"
            graph={before}
            progress={NOTHING}
            selected={selection}
            label="Canvas, earlier"
            onSelect={(key) => select(key === null ? [] : [key])}
            led
            onPanned={onPanned}
          >
            <LedBy store={store} />
          </GraphView>
        </ChangeMarksContext>
      </ReactFlowProvider>
    </section>
  );
}
