/** The canvas on which a graph is edited. */
import { Button } from "@mantine/core";
import { useMediaQuery } from "@mantine/hooks";
import {
  Background,
  BackgroundVariant,
  type Connection,
  ConnectionLineType,
  PanOnScrollMode,
  ReactFlow,
  SelectionMode,
  useStoreApi,
} from "@xyflow/react";
import { type MouseEvent, type RefObject, useEffect, useMemo, useRef, useState } from "react";
import { actionDrag } from "../../canvas/action-drag";
import { LineContext, LineEditingContext } from "../../canvas/arrows/line-store";
import type { PlaceMap } from "../../canvas/editor-store";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import { FoldedFrame } from "../../canvas/folding/folded-frame";
import { CARD } from "../../canvas/geometry/ranks";
import { arrowAt, nodeAt } from "../../canvas/hit-test";
import { useMenuPress } from "../../canvas/menu-press";
import { edgeTypes, nodeTypes } from "../../canvas/node-types";
import { type NoteEditing, NoteEditingContext } from "../../canvas/notes/note-card";
import { OutcomeSign, outcomeColor, outcomeWord } from "../../canvas/outcome";
import { ArrowTips } from "../../canvas/outcome-arrow";
import { ZoomDetail } from "../../canvas/zoom-detail";
import { addActionAt, type EditorContext, GRID } from "../../edit-actions/editor-context";
import { asOneEdit, insertInto, removeNotes } from "../../graph/edit";
import { changeNote } from "../../graph/edit/notes";
import type { Position } from "../../graph/model";
import { withLinkIds } from "../../graph/note-links";
import { endName } from "../../graph/relation-words";
import { Cursors } from "../../people/cursors";
import { PeopleAtCards } from "../../people/people";
import { useRoom } from "../../sync/use-room";
import { useStableCallback } from "../../ui/hooks";
import { AfterFirstView, boundedPart } from "../../ui/lazy-part";
import { isolated } from "../../words/isolated";
import style from "./editable-canvas.module.css";
import type { useCanvasElements } from "./use-canvas-elements";
import { outcomeOf, type Pending, useConnecting } from "./use-connecting";
import { useLineEditing } from "./use-line-editing";
import { usePinch, ZOOM } from "./use-pinch";

const GraphMap = boundedPart(() => import("./graph-map").then((part) => part.GraphMap), {
  waiting: null,
});

// Constants, since React Flow renders everything again when it gets a new object.
const SNAP_GRID: [number, number] = [GRID, GRID];
const OTHER_BUTTONS = [1, 2];
const MORE_KEYS = ["Shift", "Meta", "Control"];
const PLAIN = { hideAttribution: true };
const NOTES = ".react-flow__node-note, .react-flow__node-folded";
const NODE_TYPES = { ...nodeTypes, folded: FoldedFrame };

/**
 * Returns the event handlers that open the context menu at a right click or a long press, for the element there. That
 * is selected unless it is part of the selection.
 */
function useContextMenu(context: EditorContext) {
  return useMenuPress((screen) => {
    const target = nodeAt(screen) ?? arrowAt(screen);
    if (target === null) context.select([]);
    else if (!context.selection.has(target)) context.select([target]);
    context.openOverlay({ kind: "menu", screen });
    return true;
  });
}

interface Props {
  context: EditorContext;
  canvas: ReturnType<typeof useCanvasElements>;
  me: string;
  /** True if there is room for a map. */
  map: boolean;
  /** Called when the person has moved the view. */
  onPanned: () => void;
  /** The place of the pointer on screen; null outside of the canvas. */
  pointer: RefObject<Position | null>;
  /** The key of the note whose text is being edited. */
  writing: string | null;
}

/** Tells what to tap next after an outcome was tapped. */
function PendingHint({
  context,
  pending,
  onCancel,
}: {
  context: EditorContext;
  pending: Pending;
  onCancel: () => void;
}) {
  return (
    <div className={style.hint} role="status">
      <span>
        When {isolated(endName(context.graph, pending.key))} is{" "}
        <b style={{ color: outcomeColor[pending.outcome] }}>
          <OutcomeSign outcome={pending.outcome} /> {outcomeWord[pending.outcome]}
        </b>
        : tap what follows
      </span>
      <Button size="compact-xs" variant="subtle" onClick={onCancel}>
        Cancel
      </Button>
    </div>
  );
}

/**
 * Return the place and size in the document of a note that is drawn at a place; empty if the change
 * has none.
 */
function boxIn({ at, size }: Parameters<NoteEditing["change"]>[1], toDocument: PlaceMap) {
  if (!at || !size) return {};
  const [from, to] = [toDocument(at), toDocument([at[0] + size[0], at[1] + size[1]])];
  const whole = ([x, y]: Position): Position => [Math.round(x), Math.round(y)];
  return { at: whole(from), size: whole([to[0] - from[0], to[1] - from[1]]) };
}

/** Return the functions that edit notes on the canvas; null if the person may not edit. */
function useNoteEditing(
  context: EditorContext,
  writing: string | null,
  setResized: NoteEditing["resizing"],
  toDocument: PlaceMap,
) {
  const [only, ...others] = context.selection;
  const alone = only !== undefined && others.length === 0 ? only : null;
  const { doc, openOverlay: open, select, mayEdit } = context;
  const change = useStableCallback<Parameters<NoteEditing["change"]>, boolean>((key, change) => {
    const { text } = change;
    const linked = text === undefined ? {} : { text: withLinkIds(text, context.graph.actions) };
    return changeNote(doc, key, { ...change, ...linked, ...boxIn(change, toDocument) });
  });
  return useMemo<NoteEditing | null>(() => {
    if (!mayEdit) return null;
    return {
      editing: writing,
      alone,
      edit: (key) => (key === null ? open(null) : open({ kind: "note", key })),
      change,
      resizing: setResized,
      remove: (key) => {
        removeNotes(doc, [key.slice(2)]);
        select([]);
      },
    };
  }, [doc, change, open, select, mayEdit, writing, alone, setResized]);
}

/**
 * Return the event handlers of the canvas. They keep their identity, since every card and arrow
 * gets them.
 */
function useHandlers(
  { context, canvas, onPanned }: Pick<Props, "context" | "canvas" | "onPanned">,
  connecting: ReturnType<typeof useConnecting>,
  onMoved: () => void,
) {
  return {
    onNodeDrag: useStableCallback(canvas.onDrag),
    onNodeDragStop: useStableCallback(canvas.onDragStop),
    onSelectionDrag: useStableCallback((event: MouseEvent, nodes: CanvasNode[]) => {
      if (nodes[0]) canvas.onDrag(event, nodes[0], nodes);
    }),
    onSelectionDragStop: useStableCallback((event: MouseEvent, nodes: CanvasNode[]) => {
      if (nodes[0]) canvas.onDragStop(event, nodes[0], nodes);
    }),
    onConnect: useStableCallback(({ source, target, sourceHandle }: Connection) =>
      connecting.draw(source, target, outcomeOf(sourceHandle)),
    ),
    onConnectEnd: useStableCallback(connecting.onConnectEnd),
    onReconnect: useStableCallback(connecting.onReconnect),
    onReconnectStart: useStableCallback(connecting.onReconnectStart),
    onReconnectEnd: useStableCallback(connecting.onReconnectEnd),
    onEdgeClick: useStableCallback((event: MouseEvent, edge: Arrow) => {
      const id = edge.data?.relation;
      if (id) context.select(event.shiftKey ? [...context.selection, id] : [id]);
    }),
    onEdgeMouseEnter: useStableCallback((_: MouseEvent, edge: Arrow) => {
      canvas.lines.open(edge.data?.bundle.id ?? null);
    }),
    onEdgeMouseLeave: useStableCallback(() => canvas.lines.open(null)),
    onNodeClick: useStableCallback((event: MouseEvent) => {
      if (connecting.onClick(event)) return;
      const onNote = (event.target as Element).closest(NOTES) !== null;
      if (!onNote && context.tool === "pan") context.setPanel("details");
    }),
    onPaneClick: useStableCallback((event: MouseEvent) => {
      if (!connecting.onClick(event)) context.select([]);
    }),
    // A move without an event was made by the page.
    onMoveStart: useStableCallback((event: Event | null) => {
      if (event !== null) onPanned();
    }),
    onMove: useStableCallback((event: Event | null) => {
      if (event !== null) onMoved();
    }),
  };
}

/** Adds an action that is dropped from a list, also into the arrow below the pointer. */
function useDroppedActions(
  context: EditorContext,
  { flow, setOver }: Props["canvas"],
  frame: RefObject<HTMLDivElement | null>,
): void {
  useEffect(
    () =>
      actionDrag.onDrop(({ payload: load, x, y }) => {
        const box = frame.current?.getBoundingClientRect();
        if (!box || x < box.left || x > box.right || y < box.top || y > box.bottom) return;
        if (!context.mayEdit) return;
        const at = flow.screenToFlowPosition({ x, y });
        const position: Position = [Math.round(at.x - CARD.width / 2), Math.round(at.y - 24)];
        const arrow = arrowAt([x, y]);
        const key = asOneEdit(context.doc, () => {
          const added = addActionAt(context, load, position);
          if (arrow !== null) insertInto(context.doc, arrow, added);
          return added;
        });
        context.select([key]);
      }),
    [flow, context, frame],
  );
  // Highlights the arrow into which the dragged action would be inserted.
  useEffect(
    () =>
      actionDrag.subscribe(() => {
        const draggedItem = actionDrag.now();
        setOver(draggedItem ? arrowAt([draggedItem.x, draggedItem.y]) : null);
      }),
    [setOver],
  );
}

/** Renders the graph with React Flow. */
function Drawing({
  context,
  canvas,
  me,
  map,
  handlers,
  moved,
}: Pick<Props, "context" | "canvas" | "me" | "map"> & {
  handlers: ReturnType<typeof useHandlers>;
  moved: boolean;
}) {
  // On touch screens one finger either moves the view or draws a marquee.
  const coarse = useMediaQuery("(pointer: coarse)") ?? false;
  return (
    <ReactFlow<CanvasNode, Arrow>
      nodes={canvas.nodes}
      edges={canvas.edges}
      nodeTypes={NODE_TYPES}
      edgeTypes={edgeTypes}
      onNodesChange={canvas.onNodesChange}
      onEdgesChange={canvas.onEdgesChange}
      {...handlers}
      connectOnClick={false}
      edgesReconnectable={context.mayEdit}
      reconnectRadius={12}
      nodesDraggable={context.mayEdit}
      nodesConnectable={context.mayEdit}
      snapToGrid={context.snap}
      snapGrid={SNAP_GRID}
      elevateNodesOnSelect={false}
      selectionOnDrag={context.tool === "select"}
      panOnDrag={context.tool === "pan" ? true : coarse ? false : OTHER_BUTTONS}
      panOnScroll={false}
      panOnScrollMode={PanOnScrollMode.Free}
      selectionMode={SelectionMode.Partial}
      connectionLineType={ConnectionLineType.Bezier}
      connectionRadius={34}
      zoomOnDoubleClick={false}
      deleteKeyCode={null}
      multiSelectionKeyCode={MORE_KEYS}
      minZoom={ZOOM.least}
      maxZoom={ZOOM.most}
      onlyRenderVisibleElements={canvas.nodes.length > 150}
      nodeDragThreshold={3}
      proOptions={PLAIN}
      aria-label="Canvas"
    >
      <ArrowTips />
      <ZoomDetail />
      <Background variant={BackgroundVariant.Dots} gap={20} size={1.4} />
      {context.past === null && (
        <>
          <Cursors toView={canvas.view.toView} />
          <PeopleAtCards
            me={me}
            places={canvas.view.places}
            sizes={canvas.view.sizes}
            blockOf={canvas.folding?.blockOf}
          />
        </>
      )}
      {map && (
        <AfterFirstView>
          <GraphMap nodes={canvas.nodes} flow={canvas.flow} moved={moved} />
        </AfterFirstView>
      )}
    </ReactFlow>
  );
}

export function EditableCanvas({ context, canvas, me, map, onPanned, pointer, writing }: Props) {
  const { presence } = useRoom();
  const { flow } = canvas;
  const frame = useRef<HTMLDivElement>(null);
  const store = useStoreApi();
  useDroppedActions(context, canvas, frame);
  const openAddAt = (screen: Position, from: Pending | null) => {
    const at = flow.screenToFlowPosition({ x: screen[0], y: screen[1] });
    context.openAdd({ screen, at: [Math.round(at.x), Math.round(at.y)], from });
  };
  const connecting = useConnecting(context, openAddAt);
  const [moved, setMoved] = useState(false);
  const onMoved = useStableCallback(() => setMoved(true));
  const handlers = useHandlers({ context, canvas, onPanned }, connecting, onMoved);
  const press = useContextMenu(context);
  const onPinched = useStableCallback(() => {
    onMoved();
    onPanned();
  });
  const pinch = usePinch(context, onPinched);
  const noteEditing = useNoteEditing(context, writing, canvas.setResized, canvas.view.toDocument);
  const lineEditing = useLineEditing(context, canvas.view.toDocument);
  const onDoubleClick = (event: MouseEvent) => {
    const target = event.target as Element;
    const inner = target.closest<HTMLElement>("[data-inner]")?.dataset.inner;
    const card = target.closest<HTMLElement>(".react-flow__node-action")?.dataset.id;
    const path = inner ?? card;
    if (path !== undefined) context.store.graphsInside.now()?.enter(path);
    if (!target.classList.contains("react-flow__pane")) return;
    openAddAt([event.clientX, event.clientY], null);
  };

  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: a double click repeats what the keys A and ] do
    <div
      ref={frame}
      className="inset-0"
      onDoubleClick={onDoubleClick}
      onFocusCapture={(event) => {
        const edge = event.target.closest<HTMLElement>(".react-flow__edge")?.dataset.id;
        const focused = canvas.edges.find(({ id }) => id === edge);
        canvas.lines.open(focused?.data?.bundle.id ?? null);
      }}
      {...press}
      onPointerDownCapture={(event) => {
        press.onPointerDownCapture(event);
        pinch.down(event);
        // Touch has no Shift key: with the tool Select, each tap adds to the selection or removes
        // from it.
        if (event.pointerType !== "mouse" && context.tool === "select")
          store.setState({ multiSelectionActive: true });
      }}
      onPointerMoveCapture={(event) => {
        press.onPointerMoveCapture(event);
        pinch.move(event);
      }}
      onPointerUpCapture={(event) => {
        press.onPointerUpCapture(event);
        pinch.end(event);
      }}
      onPointerCancelCapture={(event) => {
        press.onPointerCancelCapture(event);
        pinch.end(event);
      }}
      onPointerMove={(event) => {
        if (event.pointerType === "touch") return;
        pointer.current = [event.clientX, event.clientY];
        const at = flow.screenToFlowPosition({ x: event.clientX, y: event.clientY });
        presence.tell({ cursor: [Math.round(at.x), Math.round(at.y)] });
      }}
      onPointerLeave={() => {
        pointer.current = null;
        presence.tell({ cursor: undefined });
      }}
    >
      <LineContext value={canvas.lines}>
        <NoteEditingContext value={noteEditing}>
          <LineEditingContext value={lineEditing}>
            <Drawing
              context={context}
              canvas={canvas}
              me={me}
              map={map}
              handlers={handlers}
              moved={moved}
            />
          </LineEditingContext>
        </NoteEditingContext>
      </LineContext>
      {connecting.pending && (
        <PendingHint
          context={context}
          pending={connecting.pending}
          onCancel={() => connecting.setPending(null)}
        />
      )}
    </div>
  );
}
