/** The canvas on which a graph is drawn. */
import {
  Background,
  BackgroundVariant,
  ConnectionLineType,
  MiniMap,
  type OnConnectEnd,
  PanOnScrollMode,
  ReactFlow,
  SelectionMode,
} from "@xyflow/react";
import { type MouseEvent, useEffect, useRef } from "react";
import { connect } from "../graph/edit";
import type { Position, Precondition } from "../graph/model";
import { useRoom } from "../room/use-room";
import { CARD } from "../ui/canvas/arrange";
import type { Arrow, CanvasNode } from "../ui/canvas/elements";
import { ArrowTips } from "../ui/canvas/outcome-arrow";
import { edgeTypes, nodeTypes } from "../ui/canvas/view";
import { actionCarrier } from "../ui/carry";
import { robotColor } from "../ui/robot";
import { type Bench, placeAction } from "./bench";
import style from "./canvas.module.css";
import { Cursors } from "./people";
import type { useCanvas } from "./use-canvas";

interface Props {
  bench: Bench;
  canvas: ReturnType<typeof useCanvas>;
  me: string;
  /** There is room for a map. */
  map: boolean;
  /** The person has moved the view. */
  onPanned: () => void;
}

function outcomeOf(handle: string | null | undefined): Precondition {
  return handle === "on_false" || handle === "on_error" || handle === "on_stopped"
    ? handle
    : "on_true";
}

function pointOf(event: { clientX: number; clientY: number } | TouchEvent): Position {
  if ("changedTouches" in event) {
    const touch = event.changedTouches[0];
    return touch ? [touch.clientX, touch.clientY] : [0, 0];
  }
  return [event.clientX, event.clientY];
}

function nodeAt([x, y]: Position): string | null {
  const hit = document.elementFromPoint(x, y)?.closest<HTMLElement>(".react-flow__node");
  return hit?.dataset.id ?? null;
}

export function Canvas({ bench, canvas, me, map, onPanned }: Props) {
  const { doc, presence } = useRoom();
  const { flow } = canvas;
  const frame = useRef<HTMLDivElement>(null);

  useEffect(
    () =>
      actionCarrier.onDrop(({ load, x, y }) => {
        const box = frame.current?.getBoundingClientRect();
        if (
          !bench.mayEdit ||
          !box ||
          x < box.left ||
          x > box.right ||
          y < box.top ||
          y > box.bottom
        )
          return;
        const at = flow.screenToFlowPosition({ x, y });
        const position: Position = [Math.round(at.x - CARD.width / 2), Math.round(at.y - 24)];
        bench.select([placeAction(bench, load, position)]);
      }),
    [flow, bench],
  );

  const openAddAt = (screen: Position, from: { key: string; outcome: Precondition } | null) => {
    const at = flow.screenToFlowPosition({ x: screen[0], y: screen[1] });
    bench.openAdd({ screen, at: [Math.round(at.x), Math.round(at.y)], from });
  };

  const onConnectEnd: OnConnectEnd = (event, state) => {
    const from = state.fromHandle;
    if (state.isValid || !from || from.type !== "source") return;
    const point = pointOf(event);
    const outcome = outcomeOf(from.id);
    const target = nodeAt(point);
    if (target === null) openAddAt(point, { key: from.nodeId, outcome });
    else if (target !== from.nodeId) selectNew(connect(doc, from.nodeId, target, outcome));
  };
  const selectNew = (relation: string | null) => {
    if (relation !== null) bench.select([relation]);
  };
  const onDoubleClick = (event: MouseEvent) => {
    if (!(event.target as Element).classList.contains("react-flow__pane")) return;
    openAddAt([event.clientX, event.clientY], null);
  };

  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: double click repeats what the key A does
    <div
      ref={frame}
      className={style.frame}
      onDoubleClick={onDoubleClick}
      onPointerMove={(event) => {
        if (event.pointerType === "touch") return;
        const at = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY });
        presence.tell({ cursor: [Math.round(at.x), Math.round(at.y)] });
      }}
      onPointerLeave={() => presence.tell({ cursor: undefined })}
    >
      <ReactFlow<CanvasNode, Arrow>
        nodes={canvas.nodes}
        nodesDraggable={bench.mayEdit}
        nodesConnectable={bench.mayEdit}
        edges={canvas.edges}
        nodeTypes={nodeTypes}
        edgeTypes={edgeTypes}
        onNodesChange={canvas.onNodesChange}
        onEdgesChange={canvas.onEdgesChange}
        onNodeDrag={canvas.onDrag}
        onNodeDragStop={canvas.onDragStop}
        onSelectionDrag={(event, nodes) => nodes[0] && canvas.onDrag(event, nodes[0], nodes)}
        onSelectionDragStop={(event, nodes) =>
          nodes[0] && canvas.onDragStop(event, nodes[0], nodes)
        }
        onConnect={({ source, target, sourceHandle }) =>
          selectNew(connect(doc, source, target, outcomeOf(sourceHandle)))
        }
        onConnectEnd={onConnectEnd}
        onEdgeClick={(event, edge) => {
          const id = edge.data?.relation;
          if (id) bench.select(event.shiftKey ? [...bench.selection, id] : [id]);
        }}
        onNodeClick={(event) => {
          const onHandle = (event.target as Element).closest(".react-flow__handle") !== null;
          if (!onHandle) bench.setPanel("details");
        }}
        onPaneClick={() => bench.select([])}
        selectionOnDrag={bench.tool === "select"}
        panOnDrag={bench.tool === "pan" ? true : [1, 2]}
        panOnScroll={false}
        panOnScrollMode={PanOnScrollMode.Free}
        selectionMode={SelectionMode.Partial}
        connectionLineType={ConnectionLineType.Bezier}
        connectionRadius={34}
        zoomOnDoubleClick={false}
        deleteKeyCode={null}
        multiSelectionKeyCode={["Shift", "Meta", "Control"]}
        minZoom={0.08}
        maxZoom={2.2}
        onMoveStart={(event) => {
          // A move without an event is the page's own.
          if (event !== null) onPanned();
        }}
        onlyRenderVisibleElements={canvas.nodes.length > 150}
        nodeDragThreshold={3}
        proOptions={{ hideAttribution: true }}
        aria-label="Canvas"
      >
        <ArrowTips />
        <Background variant={BackgroundVariant.Dots} gap={20} size={1.4} />
        <Cursors me={me} />
        {map && (
          <MiniMap<CanvasNode>
            position="top-right"
            pannable
            zoomable
            style={{ width: 132, height: 92 }}
            nodeBorderRadius={10}
            nodeColor={(node) =>
              node.type === "action" && node.data.action.actor !== ""
                ? robotColor(node.data.action.actor)
                : "var(--line2)"
            }
            ariaLabel="Map of the canvas"
          />
        )}
      </ReactFlow>
    </div>
  );
}
