/** The canvas with its tools, and what it says while it is empty. */
import { Button, Skeleton } from "@mantine/core";
import { IconRouteAltLeft } from "@tabler/icons-react";
import { ReactFlowProvider } from "@xyflow/react";
import { type ReactNode, useEffect, useRef } from "react";
import type { Progress } from "../api/progress";
import type { Key, Position } from "../graph/model";
import { useLink } from "../room/use-room";
import { CARD } from "../ui/canvas/arrange";
import type { ProblemCount } from "../ui/canvas/elements";
import { Empty } from "../ui/empty";
import { useBench } from "./bench";
import { Canvas, WHOLE } from "./canvas";
import style from "./stage.module.css";
import { Toolbar } from "./toolbar";
import type { EditorState } from "./use-bench";
import { useCanvas } from "./use-canvas";

interface Props {
  me: string;
  sight: EditorState["sight"];
  progress: ReadonlyMap<Key, Progress>;
  problems: ReadonlyMap<Key, ProblemCount>;
  compact: boolean;
  /** In the lower right corner. */
  corner: ReactNode;
}

function Inside({ me, sight, progress, problems, compact, corner }: Props) {
  const bench = useBench();
  const link = useLink();
  const canvas = useCanvas({
    me,
    graph: bench.graph,
    selection: bench.selection,
    select: bench.select,
    progress,
    problems,
  });
  const { flow, places, sizes } = canvas;
  const frame = useRef<HTMLDivElement>(null);
  useEffect(() => {
    sight.current = {
      places: () => places,
      sizes: () => sizes,
      view: {
        fit: () => void flow.fitView({ ...WHOLE, duration: 200 }),
        zoomIn: () => void flow.zoomIn({ duration: 120 }),
        zoomOut: () => void flow.zoomOut({ duration: 120 }),
        show: (keys) =>
          void flow.fitView({ nodes: keys.map((id) => ({ id })), maxZoom: 1, duration: 250 }),
        reveal: ([x, y]) => {
          const box = frame.current?.getBoundingClientRect();
          const a = flow.flowToScreenPosition({ x, y });
          const b = flow.flowToScreenPosition({ x: x + CARD.width, y: y + CARD.height });
          const inside =
            box && a.x > box.left && b.x < box.right && a.y > box.top && b.y < box.bottom - 64;
          if (inside) return;
          const zoom = flow.getZoom();
          void flow.setCenter(x + CARD.width / 2, y, { zoom, duration: 200 });
        },
        middle: (): Position => {
          const box = frame.current?.getBoundingClientRect();
          const [x, y] = box ? [box.left + box.width / 2, box.top + box.height / 3] : [0, 0];
          const at = flow.screenToFlowPosition({ x, y });
          return [Math.round(at.x), Math.round(at.y)];
        },
        screenOf: ([x, y]): Position => {
          const at = flow.flowToScreenPosition({ x, y });
          return [at.x, at.y];
        },
      },
    };
  }, [sight, flow, places, sizes]);

  // The first view is of the whole graph, which arrives after the canvas.
  const arrived = link.seq > 0;
  const begun = arrived && bench.graph.actions.length > 0;
  // biome-ignore lint/correctness/useExhaustiveDependencies: once, when the graph is there
  useEffect(() => {
    if (!begun) return;
    const timer = setTimeout(() => void flow.fitView(WHOLE), 60);
    return () => clearTimeout(timer);
  }, [arrived]);

  return (
    <div className={style.stage} ref={frame}>
      <Canvas
        bench={bench}
        canvas={canvas}
        me={me}
        map={!compact && bench.graph.actions.length > 3}
      />
      {!arrived && (
        <div className={style.waiting} aria-busy="true">
          <Skeleton height={92} width={208} radius="lg" />
          <Skeleton height={92} width={208} radius="lg" />
        </div>
      )}
      {arrived && bench.graph.actions.length === 0 && (
        <div className={style.empty}>
          <Empty
            icon={<IconRouteAltLeft size={22} />}
            title="What shall be done first?"
            action={
              <Button variant="filled" onClick={() => bench.openAdd()}>
                Add an action
              </Button>
            }
          >
            Double-click the canvas, press <b>A</b>, or drag an action from the list. Then drag from
            Entry to it, and from its outcomes to what follows.
          </Empty>
        </div>
      )}
      <div className={style.tools}>
        <Toolbar compact={compact} />
      </div>
      <div className={style.corner}>{corner}</div>
    </div>
  );
}

export function Stage(props: Props) {
  return (
    <ReactFlowProvider>
      <Inside {...props} />
    </ReactFlowProvider>
  );
}
