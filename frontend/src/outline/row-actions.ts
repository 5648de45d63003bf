/** Defines the actions on a row of the outline, with their keys. */

import type { EditorStore } from "../canvas/editor-store";
import type { EditorContext } from "../edit-actions/editor-context";
import { breakpointWords, PLAIN, readBreakpoint } from "../graph/breakpoints";
import { relationId } from "../graph/document-keys";
import {
  asOneEdit,
  removeActions,
  removeNotes,
  removeRelation,
  setResponse,
  swapOrder,
} from "../graph/edit";
import { setBreakpoint } from "../graph/edit/breakpoints";
import { type Action, ENTRY, type Key, type Precondition, spokenOutcomes } from "../graph/model";
import { endName } from "../graph/relation-words";
import { type KeyPress, keyOf } from "../ui/keys";
import { isolated } from "../words/isolated";
import type { BundleRow, OutlineItem } from "./rows";

/** An edit of a row that needs a field or a list to choose from. */
export type RowEditKind = "rename" | "connect" | "response" | "target";

export interface RowAction {
  readonly name:
    | RowEditKind
    | "delete"
    | "up"
    | "down"
    | "details"
    | "comments"
    | "breakpoint"
    | "enter"
    | "expand";
  readonly label: string;
  /** What is changed, where the label does not say all of it. */
  readonly detail?: string;
  /** The key as `keyOf` names it, with `Alt+` before it where needed. */
  readonly key: string;
  readonly changes: boolean;
}

const RENAME: RowAction = { name: "rename", label: "Rename", key: "F2", changes: true };
const CONNECT: RowAction = { name: "connect", label: "Connect …", key: "c", changes: true };
const DETAILS: RowAction = { name: "details", label: "Details", key: "Enter", changes: false };
const TALK: RowAction = { name: "comments", label: "Comment", key: "m", changes: false };
const WAIT: RowAction = {
  name: "breakpoint",
  label: "Set a breakpoint",
  key: "F9",
  changes: true,
};
const UP: RowAction = { name: "up", label: "Move up", key: "Alt+ArrowUp", changes: true };
const DOWN: RowAction = { name: "down", label: "Move down", key: "Alt+ArrowDown", changes: true };
const DELETE: RowAction = { name: "delete", label: "Delete", key: "Delete", changes: true };
const WRITE: RowAction = { name: "rename", label: "Write the text", key: "F2", changes: true };
const RESPONSE: RowAction = {
  name: "response",
  label: "Another response …",
  key: "r",
  changes: true,
};
const TARGET: RowAction = { name: "target", label: "Lead it elsewhere …", key: "t", changes: true };

const ENTER: RowAction = {
  name: "enter",
  label: "Open the graph inside",
  key: "]",
  changes: false,
};
const EXPAND: RowAction = {
  name: "expand",
  label: "Expand or collapse the graph inside",
  key: "}",
  changes: false,
};

/** Returns the actions for a row whose action stands for a graph. */
const levelActions = ({ name }: Action, { graphsInside }: EditorStore): readonly RowAction[] =>
  graphsInside.now()?.byName.has(name) ? [EXPAND, ENTER] : [];

export function rowActionsOf(row: OutlineItem, store: EditorStore): readonly RowAction[] {
  switch (row.kind) {
    case "entry":
      return [{ ...CONNECT, label: "Start with …" }];
    case "action": {
      const { breakpoint, missing } = row.action;
      const set = readBreakpoint(breakpoint);
      const remove = set && {
        label: "Remove the breakpoint",
        detail: breakpointWords(set, "action"),
      };
      const wait = missing ? [] : [{ ...WAIT, ...remove }];
      const inside = levelActions(row.action, store);
      return [DETAILS, ...inside, RENAME, CONNECT, ...wait, TALK, UP, DOWN, DELETE];
    }
    case "inside":
      return [
        { ...ENTER, label: "Open its level", key: "Enter" },
        ...levelActions(row.part.action, store),
      ];
    case "outcome":
      return [CONNECT, DETAILS];
    case "target":
      return row.relation.parent === ENTRY
        ? [DETAILS, TARGET, UP, DOWN, DELETE]
        : [DETAILS, RESPONSE, TARGET, UP, DOWN, DELETE];
    case "note":
      return [DETAILS, WRITE, DELETE];
  }
}

export function rowActionFor(
  row: OutlineItem,
  event: KeyPress & { readonly altKey: boolean },
  store: EditorStore,
): RowAction | null {
  const pressed = event.altKey ? `Alt+${keyOf(event)}` : keyOf(event);
  const key = pressed === "Backspace" ? "Delete" : pressed;
  return rowActionsOf(row, store).find((rowAction) => rowAction.key === key) ?? null;
}

/** After which outcomes a row says what it says. */
export function outcomesOf(row: BundleRow): readonly Precondition[] {
  return row.bundled?.length ? row.bundled : [row.outcome];
}

/** Takes a row away: an action with its arrows, or what one outcome says to one target. */
export function removeRow(context: EditorContext, row: OutlineItem): string {
  if (row.kind === "action") {
    const name = endName(context.graph, row.action.key);
    removeActions(context.doc, [row.action.key]);
    return `${isolated(name)} is deleted`;
  }
  if (row.kind === "note") {
    removeNotes(context.doc, [row.note.key.slice(2)]);
    return row.note.kind === "frame" ? "The frame is deleted" : "The note is deleted";
  }
  if (row.kind !== "target") return "";
  const id = relationId(row.relation);
  const own = outcomesOf(row);
  const others = spokenOutcomes(row.relation.conditions).filter((each) => !own.includes(each));
  if (others.length > 0 && row.relation.parent !== ENTRY) {
    asOneEdit(context.doc, () => {
      for (const outcome of own) setResponse(context.doc, id, outcome, "ignore");
    });
  } else removeRelation(context.doc, id);
  return `The arrow to ${isolated(endName(context.graph, row.relation.child))} is deleted`;
}

/** Sets a breakpoint at the action of a row, or removes the one that it has. */
export function toggleBreakpoint(context: EditorContext, row: OutlineItem): string {
  if (row.kind !== "action") return "";
  const { key, breakpoint } = row.action;
  const sets = readBreakpoint(breakpoint) === null;
  setBreakpoint(context.doc, key, sets ? PLAIN : null);
  const name = endName(context.graph, key);
  return sets
    ? `A led run waits before ${isolated(name)}`
    : `No led run waits at ${isolated(name)} any more`;
}

/** The relation through which a row stands where it stands. */
function way(context: EditorContext, row: OutlineItem): { parent: Key; child: Key } | null {
  if (row.kind === "target") return row.relation;
  if (row.kind !== "action") return null;
  const into = context.graph.relations.filter(({ child }) => child === row.action.key);
  return into.find(({ parent }) => parent === ENTRY) ?? into[0] ?? null;
}

/** Changes places with the sibling before or after it, in the order in which they are started. */
export function moveRow(context: EditorContext, row: OutlineItem, step: -1 | 1): string {
  const here = way(context, row);
  const siblings = context.graph.relations
    .filter(({ parent }) => parent === here?.parent)
    .sort((a, b) => a.parentOrder - b.parentOrder);
  const at = siblings.findIndex(({ child }) => child === here?.child);
  const one = siblings[at];
  const other = siblings[at + step];
  if (one === undefined || other === undefined) return "There is nothing to swap it with";
  swapOrder(context.doc, siblings.map(relationId), at, at + step);
  const before = step < 0 ? "before" : "after";
  return `${isolated(endName(context.graph, one.child))} stands ${before} ${isolated(endName(context.graph, other.child))}`;
}
