/** Keyboard shortcuts of edit actions, where nobody is typing; and the clipboard's own events. */
import { Kbd } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useEffect, useRef } from "react";
import style from "../../editor/menus/toolbar.module.css";
import { whenThere } from "../../ui/focus-field";
import { useKept } from "../../ui/hooks";
import { keyOf } from "../../ui/keys";
import { EDIT_ACTIONS } from "../all";
import { copiedSelection, pasteText, rememberCopied } from "../clipboard";
import { type EditAction, editActionFor, isEnabled, printedKeys } from "../edit-action";
import type { EditorContext } from "../editor-context";
import { useOwnShortcuts, withOwn } from "./own-shortcuts";

/** Returns whether single letters are shortcuts, and a setter; speech input types letters by itself. */
export function useSingleKeys() {
  return useKept("aa.single-keys", true);
}

/** Beside a value to fill in one goes on typing: its buttons are no place for shortcuts. */
const FIELDS =
  "input, textarea, select, [role=dialog], [role=menu], [role=listbox], [data-fill-in] *";

/** Returns true if the focused element uses the keys itself. */
function isTaken(target: EventTarget | null): boolean {
  if (!(target instanceof HTMLElement)) return false;
  return target.isContentEditable || target.closest(FIELDS) !== null;
}

/** The way out of a form works in the form, and so does what no field has a use for. */
function worksInForms(event: KeyboardEvent, editActions: readonly EditAction[]): boolean {
  const editAction = editActionFor(editActions, event, false);
  const free = ["to-canvas", "palette", "find", "export"].includes(editAction?.name ?? "");
  return free && document.querySelector("[role=dialog]") === null;
}

/** Lists and trees have their own use for arrow keys, Enter and Delete; the canvas shares ours. */
function isOnCanvas(target: EventTarget | null): boolean {
  if (!(target instanceof Element) || target === document.body) return true;
  return target.closest(".react-flow") !== null && !hasOwnKeys(target);
}

/** Handles of lines move and go by these keys themselves. */
const hasOwnKeys = (target: Element) => target.closest("[data-own-keys]") !== null;

const MOVING = new Set([
  "ArrowUp",
  "ArrowDown",
  "ArrowLeft",
  "ArrowRight",
  "Enter",
  "Delete",
  "Backspace",
]);

/** The search of the lists, which open for it where they are put away. */
function search(context: EditorContext): void {
  const field = document.querySelector<HTMLInputElement>("[data-search]");
  field?.focus();
  if (field !== null && document.activeElement === field) return;
  context.setPanel("library");
  whenThere("[data-search]", (found) => found.focus());
}

/** The pointer rests on the canvas and nothing has the focus: Tab is free for the search. */
function isOverCanvas(): boolean {
  const idle = document.activeElement === document.body || document.activeElement === null;
  return idle && document.querySelector(".react-flow__pane:hover") !== null;
}

export function useShortcuts(context: EditorContext): void {
  const now = useRef(context);
  now.current = context;
  const [singles] = useSingleKeys();
  const own = useOwnShortcuts(EDIT_ACTIONS);
  useEffect(() => {
    const editActions = withOwn(EDIT_ACTIONS, own);
    const onKey = (event: KeyboardEvent) => {
      if (event.defaultPrevented) return;
      const key = keyOf(event);
      if (isTaken(event.target) && !worksInForms(event, editActions)) return;
      if (MOVING.has(key) && !isOnCanvas(event.target)) return;
      if (key === "/" && singles) {
        event.preventDefault();
        search(now.current);
        return;
      }
      if (key === "Tab" && isOverCanvas()) {
        event.preventDefault();
        addAtPointer(now.current);
        return;
      }
      const editAction = editActionFor(editActions, event, singles);
      if (editAction === null || editAction.event !== undefined) return;
      // A button does what Enter does to it.
      if (key === "Enter" && event.target instanceof HTMLButtonElement) return;
      // The keys of an edit action are kept from the browser also while the action has nothing to do.
      event.preventDefault();
      if (isEnabled(editAction, now.current)) editAction.run(now.current);
      else if (editAction.idle && !event.repeat) sayIdle(editAction, now.current);
    };
    // Cards move by arrow keys of their own, which know neither undo nor frames, and take Shift with
    // Enter for one more to choose: ours come first.
    const onCanvasKey = (event: KeyboardEvent) => {
      const key = keyOf(event);
      const ours = key.startsWith("Arrow") || (key === "Enter" && event.shiftKey);
      if (!ours || isTaken(event.target)) return;
      if (!(event.target instanceof Element) || !event.target.closest(".react-flow")) return;
      if (hasOwnKeys(event.target)) return;
      onKey(event);
      event.stopPropagation();
    };
    window.addEventListener("keydown", onCanvasKey, { capture: true });
    window.addEventListener("keydown", onKey);
    return () => {
      window.removeEventListener("keydown", onCanvasKey, { capture: true });
      window.removeEventListener("keydown", onKey);
    };
  }, [singles, own]);
  useClipboard(now);
}

/** A key that does nothing without a word looks broken. */
function sayIdle(editAction: EditAction, context: EditorContext): void {
  const id = `idle-${editAction.name}`;
  const message = context.mayEdit ? editAction.idle : "Nothing can be changed here now.";
  notifications.hide(id);
  notifications.show({ id, message, autoClose: 2_500, withCloseButton: false });
}

function addAtPointer(context: EditorContext): void {
  const pointer = context.view.pointer();
  context.openAdd(pointer ? { ...pointer, from: null } : undefined);
}

/** Copy, cut and paste come as events that carry the clipboard, also on plain http. */
function useClipboard(now: { readonly current: EditorContext }): void {
  useEffect(() => {
    const actionOf = (event: ClipboardEvent) => {
      const editAction = EDIT_ACTIONS.find((each) => each.event === event.type);
      const free = !event.defaultPrevented && !isTaken(event.target);
      return editAction && free && isEnabled(editAction, now.current) ? editAction : null;
    };
    const onTake = (event: ClipboardEvent) => {
      // Text that a person has marked is what they want to copy.
      if (window.getSelection()?.isCollapsed === false || actionOf(event) === null) return;
      const piece = copiedSelection(now.current);
      rememberCopied(piece);
      event.clipboardData?.setData("text/plain", piece.text);
      event.preventDefault();
      if (event.type === "cut")
        EDIT_ACTIONS.find(({ name }) => name === "remove")?.run(now.current);
    };
    const onPaste = (event: ClipboardEvent) => {
      if (actionOf(event) === null) return;
      event.preventDefault();
      void pasteText(now.current, event.clipboardData?.getData("text/plain") ?? "");
    };
    window.addEventListener("copy", onTake);
    window.addEventListener("cut", onTake);
    window.addEventListener("paste", onPaste);
    return () => {
      window.removeEventListener("copy", onTake);
      window.removeEventListener("cut", onTake);
      window.removeEventListener("paste", onPaste);
    };
  }, [now]);
}

export function ShortcutKeys({ shortcut }: { shortcut: string }) {
  return (
    <span className={style.keys}>
      {printedKeys(shortcut).map((key) => (
        <Kbd key={key}>{key}</Kbd>
      ))}
    </span>
  );
}

export function FirstShortcut({ editAction }: { editAction: EditAction }) {
  const own = useOwnShortcuts(EDIT_ACTIONS);
  const [first] = own[editAction.name] ?? editAction.shortcuts;
  return first === undefined ? null : <ShortcutKeys shortcut={first} />;
}
