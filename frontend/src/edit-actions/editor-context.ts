/** What edit actions work on: the open graph, what is selected, and the view of it. */
import { createContext, use } from "react";
import type * as Y from "yjs";
import { CARD, unplaced } from "../canvas/geometry/arrange";
import type { DryRun } from "../dry-run/use-dry-run";
import { relationId } from "../graph/document-keys";
import { addAction, asOneEdit, moveActions, type NewAction } from "../graph/edit";
import { notesOf, placeNotes, withContents } from "../graph/edit/notes";
import type { Action, Graph, Key, Position, Precondition, Relation } from "../graph/model";

/** Where the search for an action opens, and what it is tied to once chosen. */
export interface AddRequest {
  /** On the screen, px. */
  readonly screen: Position;
  /** On the canvas. */
  readonly at: Position;
  readonly from: { readonly key: Key; readonly outcome: Precondition } | null;
  /** The arrow that takes the action in. */
  readonly into?: string;
}

export type Panel = "details" | "outline" | "json" | "comments" | "problems";
export type Tool = "pan" | "select";

/** What opens over the editor, one at a time. */
export type Overlay =
  | { readonly kind: "arrow"; readonly from: Key | null; readonly to: Key | null }
  | { readonly kind: "retarget"; readonly relation: string }
  /** The text of a note or frame is being written. */
  | { readonly kind: "note"; readonly key: string }
  | { readonly kind: "menu"; readonly screen: Position }
  | { readonly kind: "palette" }
  | { readonly kind: "keys" };

/** What a graph can be taken away as. */
export type ExportFormat = "umrf" | "svg" | "png";

export const GRID = 20; // px

/** What the canvas can do with its view. */
export interface CanvasView {
  fit(): void;
  zoomIn(): void;
  zoomOut(): void;
  /** `whole`: as large as it fits; else only so near that it can be read. */
  show(keys: readonly Key[], goal?: "middle" | "whole"): void;
  /** Moves the view only if this is not in it. */
  reveal(at: Position): void;
  /** The middle of what is seen, on the canvas. */
  middle(): Position;
  screenOf(at: Position): Position;
  /** Where the pointer rests over the canvas; null when it does not. */
  pointer(): { readonly screen: Position; readonly at: Position } | null;
  /** Gives the keyboard to what is drawn under this key. */
  focus(key: Key): void;
}

export interface EditorContext {
  /** The graph's own id. */
  readonly id: string;
  readonly doc: Y.Doc;
  readonly undo: Y.UndoManager;
  readonly graph: Graph;
  readonly canUndo: boolean;
  readonly canRedo: boolean;
  /** Whether this person may change this graph; else everything that changes it is off. */
  readonly mayEdit: boolean;
  /** Keys of actions and ends, ids of relations. */
  readonly selection: ReadonlySet<string>;
  readonly tool: Tool;
  /** Whether what is moved by hand snaps to the grid. */
  readonly snap: boolean;
  readonly view: CanvasView;
  /** The graph is played on the canvas; null while it is not. */
  readonly dryRun: DryRun | null;
  beginDryRun(): void;
  select(ids: Iterable<string>): void;
  setTool(tool: Tool): void;
  setSnap(snap: boolean): void;
  setPanel(panel: Panel): void;
  openAdd(request?: AddRequest): void;
  openOverlay(surface: Overlay | null): void;
  openFind(): void;
  /** Where everything stands, also what has no place of its own. */
  positions(): ReadonlyMap<Key, Position>;
  sizes(): ReadonlyMap<Key, { readonly width: number; readonly height: number }>;
  download(format?: ExportFormat): void;
}

export const EditorReactContext = createContext<EditorContext | null>(null);

export function useEditorContext(): EditorContext {
  const context = use(EditorReactContext);
  if (context === null) throw new Error("useBench needs an editor around it");
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
    moveActions(doc, new Map([...unplaced(graph, places), ...all]));
    placeNotes(doc, graph, all);
  });
}

export function selectedRelations(context: EditorContext): Relation[] {
  if (context.selection.size === 0) return [];
  return context.graph.relations.filter((relation) => context.selection.has(relationId(relation)));
}

/**
 * A free place for one more card: under what is selected, else in the middle of the view. Upper
 * left corner, on the canvas.
 */
export function freePosition(context: EditorContext): Position {
  const [selected] = selectedActions(context);
  const places = context.positions();
  const at = selected && places.get(selected.key);
  let [x, y] = at ? [at[0], at[1] + 180] : context.view.middle();
  if (!at) x -= CARD.width / 2;
  const isTaken = () =>
    context.graph.actions.some(({ key }) => {
      const [px, py] = places.get(key) ?? [Number.POSITIVE_INFINITY, 0];
      return Math.abs(px - x) < CARD.width + 16 && Math.abs(py - y) < CARD.height + 16;
    });
  for (let i = 0; i < 60 && isTaken(); i += 1) x += CARD.width / 2;
  return [Math.round(x), Math.round(y)];
}

/** Adds an action by hand: everything else stays where it is drawn. Answers its key. */
export function addActionAt(context: EditorContext, action: NewAction, position: Position): Key {
  return asOneEdit(context.doc, () => {
    moveActions(context.doc, unplaced(context.graph, context.positions()));
    return addAction(context.doc, { ...action, position });
  });
}
