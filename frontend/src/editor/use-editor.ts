/** The state of an open editor, and the bench that deeds work on. */

import { useLocalStorage } from "@mantine/hooks";
import { type RefObject, useCallback, useMemo, useRef, useState } from "react";
import { useMay } from "../api/use-person";
import { CARD } from "../canvas/geometry/arrange";
import { useDryRun } from "../dry-run/use-dry-run";
import {
  type AddRequest,
  type Bench,
  type Format,
  freePlace,
  type Panel,
  type Surface,
  type Tool,
  type View,
} from "../edit-actions/editor-context";
import { useCalmGraph, useCalmLink, useLinkPart, useRoom, useUndo } from "../sync/use-room";
import { takeAway } from "./export-graph";

const NONE: ReadonlySet<string> = new Set();

const BLIND: View = {
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
export interface Sight {
  view: View;
  places: Bench["places"];
  sizes: Bench["sizes"];
}

export interface EditorState {
  readonly bench: Bench;
  readonly panel: Panel;
  readonly adding: AddRequest | null;
  readonly surface: Surface | null;
  readonly sight: RefObject<Sight>;
  /** Whether the search in the graph is open. */
  readonly finding: boolean;
  closeAdd(): void;
  close(): void;
  closeFind(): void;
}

export function useEditor(id: string, onPanel: (panel: Panel) => void): EditorState {
  const { doc, undo, presence } = useRoom();
  const graph = useCalmGraph();
  const { canUndo, canRedo } = useUndo();
  const [selection, setSelection] = useState(NONE);
  const [tool, setTool] = useState<Tool>("pan");
  const [panel, setPanelNow] = useState<Panel>("details");
  const [adding, setAdding] = useState<AddRequest | null>(null);
  const [surface, setSurface] = useState<Surface | null>(null);
  const [snap, setSnap] = useLocalStorage({
    key: "aa.snap",
    defaultValue: false,
    getInitialValueInEffect: false,
  });
  const role = useMay("edit");
  const { readOnly, seq } = useCalmLink();
  const { dryRun, begin: beginDryRun } = useDryRun(id, graph, seq);
  // What is typed before the graph is there would be joined to what arrives under it, and an edit
  // would know nothing of what it replaces.
  const arrived = useLinkPart((link) => link.seq > 0);
  const mayEdit = role && readOnly === undefined && arrived;
  const [finding, setFinding] = useState(false);
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
      // The outline stands beside the panel of details, which stays as it is.
      if (next !== "outline") setPanelNow(next);
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
  const close = useCallback(() => setSurface(null), []);
  const download = useCallback((format: Format = "umrf") => {
    if (latest.current) void takeAway(latest.current, format);
  }, []);
  const closeFind = useCallback(() => setFinding(false), []);

  const bench = useMemo<Bench>(
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
      open: setSurface,
      openFind: () => setFinding(true),
      view: {
        fit: () => sight.current.view.fit(),
        zoomIn: () => sight.current.view.zoomIn(),
        zoomOut: () => sight.current.view.zoomOut(),
        show: (keys, goal) => sight.current.view.show(keys, goal),
        reveal: (at) => sight.current.view.reveal(at),
        middle: () => sight.current.view.middle(),
        screenOf: (at) => sight.current.view.screenOf(at),
        pointer: () => sight.current.view.pointer(),
        focus: (key) => sight.current.view.focus(key),
      },
      places: () => sight.current.places(),
      sizes: () => sight.current.sizes(),
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
  latest.current = bench;
  return { bench, panel, adding, finding, surface, sight, closeAdd, closeFind, close };
}
