/** The context of edit actions: the open graph, the selection, and the view. */
import { createContext, use } from "react";
import type * as Y from "yjs";
import type { DryRunPart } from "../api/dry-runs";
import type { EditorStore } from "../canvas/editor-store";
import { freeSpot, placeAfter, unplaced } from "../canvas/geometry/arrange";
import { CARD } from "../canvas/geometry/ranks";
import type { DryRunSeed } from "../dry-run/seed";
import type { DryRun } from "../dry-run/use-dry-run";
import { relationId } from "../graph/document-keys";
import {
  addAction,
  asOneEdit,
  isUndrawn,
  moveActions,
  moveLoose,
  type NewAction,
  setEntry,
} from "../graph/edit";
import { notesOf, placeNotes, withContents } from "../graph/edit/notes";
import type { UndoHistory } from "../graph/edit/undo-history";
import {
  type Action,
  EXIT,
  type Graph,
  type Key,
  type Position,
  type Precondition,
  type Relation,
} from "../graph/model";

/** The place where the search for an action opens, and the thing to which the chosen action is connected. */
export interface AddRequest {
  /** The place on the screen, px. */
  readonly screen: Position;
  /** The place on the canvas; null where there is room, without a place of its own. */
  readonly at: Position | null;
  readonly from: { readonly key: Key; readonly outcome: Precondition } | null;
  /** The arrow that takes the action in. */
  readonly into?: string;
}

export type Panel =
  | "details"
  | "library"
  | "outline"
  | "history"
  | "json"
  | "comments"
  | "courses"
  | "problems";
export type Tool = "pan" | "select";

/** The parts that open over the editor, one at a time. */
export type Overlay =
  | { readonly kind: "arrow"; readonly from: Key | null; readonly to: Key | null }
  | {
      readonly kind: "retarget";
      readonly relation: string;
      readonly outcome?: Precondition;
    }
  /** The text of a note or frame is being written. */
  | { readonly kind: "note"; readonly key: string }
  | { readonly kind: "menu"; readonly screen: Position }
  /** The C++ packages of all actions; `action`: the name of the one that is shown first. */
  | { readonly kind: "packages"; readonly action?: string }
  /** The graph and those inside of it as one graph. */
  | { readonly kind: "flat" }
  /** A graph of its own for these actions. */
  | { readonly kind: "extract"; readonly actions: readonly Key[] }
  /** The actions of the graph for which this one stands, in its place. */
  | { readonly kind: "unpack"; readonly action: Key }
  /** Further tries of this action. */
  | { readonly kind: "tries"; readonly action: Key }
  /** Copies of these actions, each with another value. */
  | { readonly kind: "copies"; readonly actions: readonly Key[] }
  /** The graph is called otherwise now, and others have actions that stand for it under the old name. */
  | {
      readonly kind: "renamed";
      readonly before: string;
      readonly name: string;
      readonly uses: readonly string[];
    }
  /** A run that begins with these actions, by full name; `only`: it plays nothing else. */
  | { readonly kind: "begin"; readonly at: readonly string[]; readonly only: boolean }
  | { readonly kind: "palette" }
  | { readonly kind: "keys" };

/** A moment of the past that is shown, and with what it is compared. */
export interface PastPlace {
  /** The change after which the graph was so. */
  readonly at: number;
  /** `own`: with the beginning of the sitting; `good`: with the last good run before it; else with
   * another moment, or with what a run was started with. */
  readonly with: "own" | "good" | "nothing" | "now" | number | `run/${string}`;
}

/** The formats in which a graph can be exported. */
export type ExportFormat = "umrf" | "svg" | "png";

export const GRID = 20; // px

/** The view of the canvas, and how to change it. */
export interface CanvasView {
  /** Shows the whole graph, however small. */
  fit(): void;
  /** Shows what is shown on opening: the whole graph where it can be read, else its beginning. */
  open(): void;
  /** Shows again what was shown on opening or by Fit, unless somebody has moved the view since. */
  reopen(): void;
  zoomIn(): void;
  zoomOut(): void;
  /** Shows these keys. `whole`: as large as they fit; else only so large that they can be read. */
  show(keys: readonly Key[], goal?: "middle" | "whole"): void;
  /** Moves the view only if this is not in it. */
  reveal(at: Position): void;
  /** Near the middle of what is seen, on the canvas: where something new is put. */
  middle(): Position;
  screenOf(at: Position): Position;
  /** Returns the place of the pointer over the canvas; null when it is elsewhere. */
  pointer(): { readonly screen: Position; readonly at: Position } | null;
  /** Gives the keyboard to what is drawn under this key. */
  focus(key: Key): void;
}

export interface EditorContext {
  /** The id of the graph. */
  readonly id: string;
  readonly doc: Y.Doc;
  readonly undo: UndoHistory;
  readonly graph: Graph;
  readonly canUndo: boolean;
  readonly canRedo: boolean;
  /** True if this person may change what is shown; else every edit action that changes it is off. */
  readonly mayEdit: boolean;
  /** True if this person may start runs, be it in the simulator. */
  readonly mayRun: boolean;
  /** Keys of actions and ends, ids of relations. */
  readonly selection: ReadonlySet<string>;
  readonly tool: Tool;
  /** True if things that are moved by hand snap to the grid. */
  readonly snap: boolean;
  /** Frames that this person sees folded, on this device: keys that may be gone. */
  readonly folded: ReadonlySet<string>;
  readonly view: CanvasView;
  readonly store: EditorStore;
  /** The graph is played on the canvas; null while it is not. */
  readonly dryRun: DryRun | null;
  /** The past moment that is shown, to look at; null for the present. */
  readonly past: PastPlace | null;
  lookAt(place: PastPlace | null): void;
  /** True if this person may change the present graph; the past cannot be changed. */
  readonly mayGoBack: boolean;
  /** Begins a dry-run. `from` is a recorded moment of a run; `script` says what actions do at first. */
  beginDryRun(
    from?: DryRunSeed | null,
    script?: DryRunSeed["behaviours"],
    part?: DryRunPart | null,
  ): void;
  select(ids: Iterable<string>): void;
  setTool(tool: Tool): void;
  setSnap(snap: boolean): void;
  fold(frames: readonly string[], folded: boolean): void;
  setPanel(panel: Panel): void;
  openAdd(request?: AddRequest): void;
  openOverlay(surface: Overlay | null): void;
  openFind(): void;
  /** Returns the places of all things, also of those without a place of their own. */
  positions(): ReadonlyMap<Key, Position>;
  sizes(): ReadonlyMap<Key, { readonly width: number; readonly height: number }>;
  download(format?: ExportFormat): void;
}

export const EditorReactContext = createContext<EditorContext | null>(null);

export function useEditorContext(): EditorContext {
  const context = use(EditorReactContext);
  if (context === null) throw new Error("useEditorContext needs an editor around it");
  return context;
}

export function selectedActions(context: EditorContext): Action[] {
  if (context.selection.size === 0) return [];
  return context.graph.actions.filter((action) => context.selection.has(action.key));
}

/** Keys of the notes and frames that are chosen. */
export function selectedNotes(context: EditorContext): string[] {
  if (context.selection.size === 0) return [];
  return notesOf(context.graph).flatMap(({ key }) => (context.selection.has(key) ? [key] : []));
}

/** Writes places by hand as one edit: frames take along what lies in them, the rest stays. */
export function writePositions(context: EditorContext, moved: ReadonlyMap<string, Position>): void {
  const { doc, graph } = context;
  const places = context.positions();
  const all = withContents(graph, moved, places, context.sizes());
  asOneEdit(doc, () => {
    moveLoose(doc, graph.direction, unplaced(graph, places));
    moveActions(doc, all);
    placeNotes(doc, graph, all);
  });
}

const NUDGED = "nudged";

/** Moves something by a press of a key: presses in a row, of the same thing, are one step of undo. */
export function nudging({ undo }: EditorContext, what: string, write: () => void): void {
  const last = undo.undoStack.at(-1);
  undo.captureTimeout = last?.meta.get(NUDGED) === what ? 900 : 0;
  write();
  undo.captureTimeout = 0;
  undo.undoStack.at(-1)?.meta.set(NUDGED, what);
}

export function selectedRelations(context: EditorContext): Relation[] {
  if (context.selection.size === 0) return [];
  return context.graph.relations.filter((relation) => context.selection.has(relationId(relation)));
}

/**
 * Returns the boxes that cards and ends occupy. An exit that nobody has placed is left out, since it moves away by
 * itself.
 */
export function takenBoxes(context: EditorContext) {
  const floating = context.graph.exitPosition === null;
  const sizes = context.sizes();
  return [...context.positions()].flatMap(([key, [x, y]]) =>
    key.startsWith("g/") || (floating && key === EXIT)
      ? []
      : [{ x, y, ...(sizes.get(key) ?? CARD) }],
  );
}

/** The nearest place from here that is free. Upper left corner, on the canvas. */
export function freeFrom(context: EditorContext, start: Position): Position {
  return freeSpot(start, CARD, takenBoxes(context), context.graph.direction);
}

/**
 * A free place for one more card: behind what is selected, else in the middle of the view. Upper
 * left corner, on the canvas.
 */
export function freePosition(context: EditorContext): Position {
  const [selected] = selectedActions(context);
  const at = selected && context.positions().get(selected.key);
  if (at) {
    const size = context.sizes().get(selected.key) ?? CARD;
    const after = placeAfter({ x: at[0], y: at[1], ...size }, context.graph.direction);
    return freeFrom(context, after);
  }
  const [x, y] = context.view.middle();
  return freeFrom(context, [x - CARD.width / 2, y]);
}

/**
 * Adds an action by hand: everything else stays where it is drawn. Without a `position` it is drawn where there is
 * room, as long as nobody moves it. The first one of a graph is what
 * the graph starts with. Returns its key.
 */
export function addActionAt(
  context: EditorContext,
  action: NewAction,
  position: Position | null,
): Key {
  return asOneEdit(context.doc, () => {
    const first = isUndrawn(context.doc);
    const { graph } = context;
    moveLoose(context.doc, graph.direction, unplaced(graph, context.positions()));
    const key = addAction(context.doc, { ...action, ...(position && { position }) });
    if (first) setEntry(context.doc, key);
    return key;
  });
}
