/** An edit action: something a person can do in the editor, as a value. Toolbar, menus, palette, keys and help are made of these. */
import type { Icon } from "@tabler/icons-react";
import { type KeyPress, keysOf } from "../ui/keys";
import type { EditorContext } from "./editor-context";

/** Under which heading help and menus list it. */
export type EditActionGroup = "Draw" | "Arrange" | "Look" | "Graph" | "Dry-run";

export interface EditAction {
  readonly name: string;
  readonly label: string;
  readonly group: EditActionGroup;
  /** `Mod` is Ctrl, and ⌘ on a Mac. The first is shown; all work. */
  readonly shortcuts: readonly string[];
  readonly icon: Icon;
  /** True if it changes the graph, which not everybody may do. */
  readonly changes: boolean;
  /** The browser raises an event of its own for its shortcut, and gives the clipboard with it. */
  readonly event?: "copy" | "cut" | "paste";
  /** Further words by which the palette finds the action. */
  readonly also?: string;
  enabled(context: EditorContext): boolean;
  /** The message for a person who presses its key while it has nothing to do. */
  readonly idle?: string;
  run(context: EditorContext): void;
}

/** Returns true if this person can do it now. */
export function isEnabled(editAction: EditAction, context: EditorContext): boolean {
  return (!editAction.changes || context.mayEdit) && editAction.enabled(context);
}

/** Returns its label, with the reason why it is off where the canvas does not show that. */
export function labelOf(editAction: EditAction, context: EditorContext): string {
  return editAction.changes && !context.mayEdit
    ? `${editAction.label} (view only)`
    : editAction.label;
}

export const onMac = typeof navigator !== "undefined" && /Mac|iP(hone|ad)/.test(navigator.platform);

export interface Pressed extends KeyPress {
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly shiftKey: boolean;
  readonly altKey: boolean;
}

/** Returns true if a key press is this shortcut. */
export function isPressed(
  shortcut: string,
  event: Pressed,
  mac = onMac,
  pressed = keysOf(event),
): boolean {
  const parts = shortcut.split("+");
  const last = parts.pop() ?? "";
  const key = last === "Plus" ? "+" : last;
  const mod = mac ? event.metaKey : event.ctrlKey;
  const other = mac ? event.ctrlKey : event.metaKey;
  const letter = pressed.some((name) =>
    key.length === 1 ? name.toLowerCase() === key.toLowerCase() : name === key,
  );
  // Signs such as "+" or "?" carry their own Shift on some keyboards.
  const sign = key.length === 1 && !/[a-z0-9]/i.test(key);
  const shift = sign || event.shiftKey === parts.includes("Shift");
  const alt = event.altKey === parts.includes("Alt");
  return letter && mod === parts.includes("Mod") && !other && alt && shift;
}

/** Returns true if a shortcut is one printed character without Mod or Alt: such keys can be switched off. */
function isSingleKey(shortcut: string): boolean {
  const parts = shortcut.split("+");
  const last = parts.at(-1) ?? "";
  return (last.length === 1 || last === "Plus") && !parts.includes("Mod") && !parts.includes("Alt");
}

const signs: Record<string, string> = {
  Delete: "Del",
  Backspace: "⌫",
  Plus: "+",
  ArrowUp: "↑",
  ArrowDown: "↓",
  ArrowLeft: "←",
  ArrowRight: "→",
  ContextMenu: "Menu",
  Escape: "Esc",
};

/** Returns the keys of a shortcut as they are printed on a keyboard. */
export function printedKeys(shortcut: string, mac = onMac): string[] {
  const parts = shortcut.split("+");
  const last = parts.at(-1) ?? "";
  const sign = last.length === 1 && !/[a-z0-9]/i.test(last);
  return parts.flatMap((part) => {
    if (part === "Mod") return mac ? "⌘" : "Ctrl";
    if (part === "Shift") return sign ? [] : mac ? "⇧" : "Shift";
    if (part === "Alt") return mac ? "⌥" : "Alt";
    return signs[part] ?? (part.length === 1 ? part.toUpperCase() : part);
  });
}

/** The edit action that a key press asks for. */
export function editActionFor(
  editActions: readonly EditAction[],
  event: Pressed,
  singles = true,
): EditAction | null {
  const found = keysOf(event).map((pressed) =>
    editActions.find((editAction) =>
      editAction.shortcuts.some(
        (key) => (singles || !isSingleKey(key)) && isPressed(key, event, onMac, [pressed]),
      ),
    ),
  );
  return found.find((editAction) => editAction !== undefined) ?? null;
}
