/** The state of an open editor, and the context that edit actions work on. */

import { useLocalStorage } from "@mantine/hooks";
import { type RefObject, useCallback, useMemo, useRef, useState } from "react";
import { useMay } from "../api/use-person";
import { CARD } from "../canvas/geometry/arrange";
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
import {
  useLinkPart,
  useRoom,
  useThrottledGraph,
  useThrottledLink,
  useUndo,
} from "../sync/use-room";
import { exportGraph } from "./export-graph";

const NONE: ReadonlySet<string> = new Set();

const NO_CANVAS_VIEW: CanvasView = {
  fit: () => {},
  zoomIn: () => {},
  zoomOut: () => {},
  show: () => {},
  reveal: () => {},
  middle: () => [0, 0],
  screenOf: () => [0, 0],
  pointer: () => null,
  focus: () => {},
};

/** What only the canvas knows; filled in by it while it is shown. */
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
  /** Whether the search in the graph is open. */
  readonly finding: boolean;
  closeAdd(): void;
  closeOverlay(): void;
  closeFind(): void;
}

export function useEditor(id: string, onPanel: (panel: Panel) => void): EditorState {
  const { doc, undo, presence } = useRoom();
  const graph = useThrottledGraph();
  const { canUndo, canRedo } = useUndo();
  const [selection, setSelection] = useState(NONE);
  const [tool, setTool] = useState<Tool>("pan");
  const [panel, setPanelNow] = useState<Panel>("details");
  const [adding, setAdding] = useState<AddRequest | null>(null);
  const [overlay, setSurface] = useState<Overlay | null>(null);
  const [snap, setSnap] = useLocalStorage({
    key: "aa.snap",
    defaultValue: false,
    getInitialValueInEffect: false,
  });
  const role = useMay("edit");
  const { readOnly, seq } = useThrottledLink();
  const { dryRun, begin: beginDryRun } = useDryRun(id, graph, seq);
  // What is typed before the graph is there would be joined to what arrives under it, and an edit
  // would know nothing of what it replaces.
  const arrived = useLinkPart((link) => link.seq > 0);
  const mayEdit = role && readOnly === undefined && arrived;
  const [finding, setFinding] = useState(false);
  const canvasHandle = useRef<CanvasHandle>({
    view: NO_CANVAS_VIEW,
    positions: () => new Map(),
    sizes: () => new Map(),
  });

  const select = useCallback(
    (ids: Iterable<string>) => {
      const next = new Set(ids);
      setSelection(next);
      presence.tell({ selection: [...next] });
    },
    [presence],
  );
  const setPanel = useCallback(
    (next: Panel) => {
      // The outline stands beside the panel of details, which stays as it is.
      if (next !== "outline") setPanelNow(next);
      onPanel(next);
    },
    [onPanel],
  );
  const latest = useRef<EditorContext | null>(null);
  const openAdd = useCallback((request?: AddRequest) => {
    if (latest.current?.mayEdit === false) return;
    if (request || latest.current === null) {
      setAdding(request ?? null);
      return;
    }
    const [x, y] = freePosition(latest.current);
    const at = [x + CARD.width / 2, y] as const;
    setAdding({ screen: latest.current.view.screenOf(at), at, from: null });
  }, []);
  const closeAdd = useCallback(() => setAdding(null), []);
  const close = useCallback(() => setSurface(null), []);
  const download = useCallback((format: ExportFormat = "umrf") => {
    if (latest.current) void exportGraph(latest.current, format);
  }, []);
  const closeFind = useCallback(() => setFinding(false), []);

  const context = useMemo<EditorContext>(
    () => ({
      id,
      doc,
      undo,
      graph,
      canUndo,
      canRedo,
      mayEdit,
      selection,
      tool,
      snap,
      dryRun,
      beginDryRun,
      select,
      setTool,
      setSnap,
      setPanel,
      openAdd,
      openOverlay: setSurface,
      openFind: () => setFinding(true),
      view: {
        fit: () => canvasHandle.current.view.fit(),
        zoomIn: () => canvasHandle.current.view.zoomIn(),
        zoomOut: () => canvasHandle.current.view.zoomOut(),
        show: (keys, goal) => canvasHandle.current.view.show(keys, goal),
        reveal: (at) => canvasHandle.current.view.reveal(at),
        middle: () => canvasHandle.current.view.middle(),
        screenOf: (at) => canvasHandle.current.view.screenOf(at),
        pointer: () => canvasHandle.current.view.pointer(),
        focus: (key) => canvasHandle.current.view.focus(key),
      },
      positions: () => canvasHandle.current.positions(),
      sizes: () => canvasHandle.current.sizes(),
      download,
    }),
    [
      id,
      doc,
      undo,
      graph,
      canUndo,
      canRedo,
      mayEdit,
      selection,
      tool,
      snap,
      dryRun,
      beginDryRun,
      select,
      setSnap,
      setPanel,
      openAdd,
      download,
    ],
  );
  latest.current = context;
  return {
    context,
    panel,
    adding,
    finding,
    overlay,
    canvasHandle,
    closeAdd,
    closeFind,
    closeOverlay: close,
  };
}
