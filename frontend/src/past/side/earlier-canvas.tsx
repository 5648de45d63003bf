/** The earlier of two moments on a canvas of its own, whose view is that of the later one. */
import { ReactFlowProvider, useReactFlow, useStoreApi } from "@xyflow/react";
import { useLayoutEffect } from "react";
import { GraphView } from "../../canvas/graph-view";
import { ChangeMarked } from "../../canvas/marks/change-marks";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { Progress } from "../../status/progress";
import style from "./side.module.css";
import type { EarlierCanvasProps } from "./side-by-side";
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
