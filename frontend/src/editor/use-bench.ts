/** The state of an open editor, and the bench that deeds work on. */
import { type RefObject, useCallback, useMemo, useRef, useState } from "react";
import { useMay } from "../api/person";
import { useGraph, useLink, useRoom, useUndo } from "../room/use-room";
import { CARD } from "../ui/canvas/arrange";
import { type AddRequest, type Bench, freePlace, type Panel, type Tool, type View } from "./bench";

const NONE: ReadonlySet<string> = new Set();

const BLIND: View = {
  fit: () => {},
  zoomIn: () => {},
  zoomOut: () => {},
  show: () => {},
  reveal: () => {},
  middle: () => [0, 0],
  screenOf: () => [0, 0],
};

/** What only the canvas knows; filled in by it while it is shown. */
export interface Sight {
  view: View;
  places: Bench["places"];
  sizes: Bench["sizes"];
}

export interface EditorState {
  readonly bench: Bench;
  readonly panel: Panel;
  readonly adding: AddRequest | null;
  readonly sight: RefObject<Sight>;
  closeAdd(): void;
}

function download(id: string, name: string): void {
  const link = document.createElement("a");
  link.href = `/api/graphs/${encodeURIComponent(id)}/umrf`;
  link.download = `${name || "graph"}.umrf.graph.json`;
  link.click();
}

export function useEditor(id: string, onPanel: (panel: Panel) => void): EditorState {
  const { doc, undo, presence } = useRoom();
  const graph = useGraph();
  const { canUndo, canRedo } = useUndo();
  const role = useMay("edit");
  const { readOnly } = useLink();
  const mayEdit = role && readOnly === undefined;
  const [selection, setSelection] = useState(NONE);
  const [tool, setTool] = useState<Tool>("pan");
  const [panel, setPanelNow] = useState<Panel>("details");
  const [adding, setAdding] = useState<AddRequest | null>(null);
  const sight = useRef<Sight>({ view: BLIND, places: () => new Map(), sizes: () => new Map() });

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
      setPanelNow(next);
      onPanel(next);
    },
    [onPanel],
  );
  const latest = useRef<Bench | null>(null);
  const openAdd = useCallback((request?: AddRequest) => {
    if (latest.current?.mayEdit === false) return;
    if (request || latest.current === null) {
      setAdding(request ?? null);
      return;
    }
    const [x, y] = freePlace(latest.current);
    const at = [x + CARD.width / 2, y] as const;
    setAdding({ screen: latest.current.view.screenOf(at), at, from: null });
  }, []);
  const closeAdd = useCallback(() => setAdding(null), []);

  const bench = useMemo<Bench>(
    () => ({
      doc,
      undo,
      graph,
      canUndo,
      canRedo,
      mayEdit,
      selection,
      tool,
      select,
      setTool,
      setPanel,
      openAdd,
      view: {
        fit: () => sight.current.view.fit(),
        zoomIn: () => sight.current.view.zoomIn(),
        zoomOut: () => sight.current.view.zoomOut(),
        show: (keys) => sight.current.view.show(keys),
        reveal: (at) => sight.current.view.reveal(at),
        middle: () => sight.current.view.middle(),
        screenOf: (at) => sight.current.view.screenOf(at),
      },
      places: () => sight.current.places(),
      sizes: () => sight.current.sizes(),
      download: () => download(id, graph.name),
    }),
    [doc, undo, graph, canUndo, canRedo, mayEdit, selection, tool, select, setPanel, openAdd, id],
  );
  latest.current = bench;
  return { bench, panel, adding, sight, closeAdd };
}
