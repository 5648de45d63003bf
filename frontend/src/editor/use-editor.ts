/** The state of an open editor, and the context on which edit actions work. */

import { type RefObject, useCallback, useMemo, useRef, useState } from "react";
import { useMay } from "../api/people";
import { useEditorStore } from "../canvas/editor-store";
import { isUnplaced } from "../canvas/geometry/arrange";
import { inPortrait, topDown } from "../canvas/geometry/portrait";
import { CARD } from "../canvas/geometry/ranks";
import { useTopDown } from "../canvas/top-down";
import { useDryRun } from "../dry-run/use-dry-run";
import {
  type AddRequest,
  type CanvasView,
  type EditorContext,
  type ExportFormat,
  freePosition,
  type Overlay,
  type Panel,
  type Tool,
} from "../edit-actions/editor-context";
import type { Graph } from "../graph/model";
import {
  useLinkPart,
  useRoom,
  useThrottledGraph,
  useThrottledLink,
  useUndo,
} from "../sync/use-room";
import { useIsPhone, useKept, useKeptKeys } from "../ui/hooks";
import { exportGraph } from "./export-graph";
import { NO_PAST, type Past } from "./use-past";

const NONE: ReadonlySet<string> = new Set();

const NO_CANVAS_VIEW: CanvasView = {
  fit: () => {},
  open: () => {},
  reopen: () => {},
  zoomIn: () => {},
  zoomOut: () => {},
  show: () => {},
  reveal: () => {},
  middle: () => [0, 0],
  screenOf: () => [0, 0],
  pointer: () => null,
  focus: () => {},
};

/** Functions that the canvas provides while it is shown. */
interface CanvasHandle {
  view: CanvasView;
  positions: EditorContext["positions"];
  sizes: EditorContext["sizes"];
}

export interface EditorState {
  readonly context: EditorContext;
  readonly panel: Panel;
  readonly adding: AddRequest | null;
  readonly overlay: Overlay | null;
  readonly canvasHandle: RefObject<CanvasHandle>;
  /** True while the search within the graph is open. */
  readonly isFindOpen: boolean;
  closeAdd(): void;
  closeOverlay(): void;
  closeFind(): void;
}

/**
 * Return the graph as this screen draws it. On a phone one without places may be drawn top-down; so is one with
 * places on the canvas, as long as this device asks for it.
 */
export function usePortrait(graph: Graph, isOnCanvas: boolean): Graph {
  const phone = useIsPhone();
  const { isTurned } = useTopDown();
  return useMemo(() => {
    if (!phone) return graph;
    if (isTurned && isOnCanvas && !isUnplaced(graph)) return topDown(graph);
    const { innerWidth, innerHeight } = window;
    return inPortrait(graph, { width: innerWidth, height: innerHeight });
  }, [graph, phone, isTurned, isOnCanvas]);
}

/** Return the graph and its document, and what this person may do with it. */
function useEdited(id: string, { place: past, seen, lookAt }: Past, isOnCanvas: boolean) {
  const { doc, undo } = useRoom();
  const stored = useThrottledGraph();
  const now = usePortrait(stored, isOnCanvas);
  const undoable = useUndo();
  const role = useMay("edit");
  const mayRun = useMay("simulate");
  const { readOnly, seq } = useThrottledLink();
  const { dryRun, begin: beginDryRun } = useDryRun(id, stored, seq);
  // Nobody may edit before the graph has arrived: an edit would not know what it replaces.
  const arrived = useLinkPart((link) => link.seq > 0);
  const mayGoBack = role && readOnly === undefined && arrived;
  const graph = past === null ? now : (seen?.graph ?? now);
  // While the past is shown, or a placed graph stands top-down, it is read-only.
  const isTurned = isUnplaced(now) && !isUnplaced(stored);
  const mayEdit = mayGoBack && past === null && !isTurned;
  const canUndo = undoable.canUndo && past === null;
  const canRedo = undoable.canRedo && past === null;
  return useMemo(
    () => ({
      ...{ id, doc, undo, graph, canUndo, canRedo, mayEdit, dryRun, beginDryRun },
      ...{ past, lookAt, mayGoBack, mayRun },
    }),
    [
      id,
      doc,
      undo,
      graph,
      canUndo,
      canRedo,
      mayEdit,
      dryRun,
      beginDryRun,
      past,
      lookAt,
      mayGoBack,
      mayRun,
    ],
  );
}

/** Return the selection and the tool of the pointer. */
function useTools() {
  const { presence } = useRoom();
  const [selection, setSelection] = useState(NONE);
  const [tool, setTool] = useState<Tool>("pan");
  const [snap, setSnap] = useKept("aa.snap", false);
  const select = useCallback(
    (ids: Iterable<string>) => {
      const next = new Set(ids);
      setSelection(next);
      presence.tell({ selection: [...next] });
    },
    [presence],
  );
  return useMemo(
    () => ({ selection, select, tool, setTool, snap, setSnap }),
    [selection, select, tool, snap, setSnap],
  );
}

/**
 * Return the state of panels and dialogs, and the functions that open them. `latest`: the current
 * context.
 */
function useDialogs(latest: RefObject<EditorContext | null>, onPanel: (panel: Panel) => void) {
  const [panel, setPanelNow] = useState<Panel>("details");
  const [adding, setAdding] = useState<AddRequest | null>(null);
  const [overlay, openOverlay] = useState<Overlay | null>(null);
  const [isFindOpen, setFinding] = useState(false);
  const setPanel = useCallback(
    (next: Panel) => {
      // Lists open at the left; the panel of details at the right stays as it is.
      if (next !== "outline" && next !== "library" && next !== "history") setPanelNow(next);
      onPanel(next);
    },
    [onPanel],
  );
  const openAdd = useCallback(
    (request?: AddRequest) => {
      if (latest.current?.mayEdit === false) return;
      if (request || latest.current === null) {
        setAdding(request ?? null);
        return;
      }
      const [x, y] = freePosition(latest.current);
      const at = [x + CARD.width / 2, y] as const;
      setAdding({ screen: latest.current.view.screenOf(at), at, from: null });
    },
    [latest],
  );
  const closeAdd = useCallback(() => setAdding(null), []);
  const closeOverlay = useCallback(() => openOverlay(null), []);
  const closeFind = useCallback(() => setFinding(false), []);
  const openers = useMemo(
    () => ({ setPanel, openAdd, openOverlay, openFind: () => setFinding(true) }),
    [setPanel, openAdd],
  );
  return {
    openers,
    opened: { panel, adding, overlay, isFindOpen, closeAdd, closeOverlay, closeFind },
  };
}

/** Return functions that pass calls to the current canvas. */
function canvasOf(handle: RefObject<CanvasHandle>) {
  const view: CanvasView = {
    fit: () => handle.current.view.fit(),
    open: () => handle.current.view.open(),
    reopen: () => handle.current.view.reopen(),
    zoomIn: () => handle.current.view.zoomIn(),
    zoomOut: () => handle.current.view.zoomOut(),
    show: (keys, goal) => handle.current.view.show(keys, goal),
    reveal: (at) => handle.current.view.reveal(at),
    middle: () => handle.current.view.middle(),
    screenOf: (at) => handle.current.view.screenOf(at),
    pointer: () => handle.current.view.pointer(),
    focus: (key) => handle.current.view.focus(key),
  };
  return {
    view,
    positions: () => handle.current.positions(),
    sizes: () => handle.current.sizes(),
  };
}

/**
 * Return the state of an editor. `onPanel`: called when an edit action opens a panel; `past`: the
 * moment shown; `isOnCanvas`: a phone shows the canvas.
 */
export function useEditor(
  id: string,
  onPanel: (panel: Panel) => void,
  past: Past = NO_PAST,
  isOnCanvas = false,
): EditorState {
  const latest = useRef<EditorContext | null>(null);
  const store = useEditorStore();
  const edited = useEdited(id, past, isOnCanvas);
  const tools = useTools();
  const { keys: folded, put: fold } = useKeptKeys("aa.folded", id);
  const { openers, opened } = useDialogs(latest, onPanel);
  const canvasHandle = useRef<CanvasHandle>({
    view: NO_CANVAS_VIEW,
    positions: () => new Map(),
    sizes: () => new Map(),
  });
  const download = useCallback((format: ExportFormat = "umrf") => {
    if (latest.current) void exportGraph(latest.current, format);
  }, []);
  const context = useMemo<EditorContext>(
    () => ({
      ...{ ...edited, ...tools, ...openers, ...canvasOf(canvasHandle) },
      ...{ store, folded, fold, download },
    }),
    [store, edited, tools, folded, fold, openers, download],
  );
  latest.current = context;
  return { context, canvasHandle, ...opened };
}
