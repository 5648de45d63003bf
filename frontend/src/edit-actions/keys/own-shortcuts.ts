/**
 * Shortcuts of one's own, kept on this device: what replaces those of an edit action, by its name.
 *
 * What is kept is read as if a stranger had written it: a key that is not to be had is dropped, so that
 * nothing there can stand in the way of STOP.
 */
import { useSyncExternalStore } from "react";
import { keyOf } from "../../ui/keys";
import type { EditAction, Pressed } from "../edit-action";
import { onMac, printedKeys } from "../edit-action";

/** The shortcuts of some edit actions; none where the list is empty. */
export type OwnShortcuts = Readonly<Record<string, readonly string[]>>;

const MODIFIERS = ["Control", "Shift", "Alt", "Meta", "AltGraph", "CapsLock", "Dead", "Process"];

/** Returns the pressed keys as a shortcut; null as long as only modifiers are pressed. */
export function shortcutOf(event: Pressed, mac = onMac): string | null {
  const key = keyOf(event);
  if (MODIFIERS.includes(key) || (mac ? event.ctrlKey : event.metaKey)) return null;
  const last =
    key === "+" ? "Plus" : key === " " ? "Space" : key.length === 1 ? key.toLowerCase() : key;
  const mod = mac ? event.metaKey : event.ctrlKey;
  const held = [mod && "Mod", event.altKey && "Alt", event.shiftKey && "Shift"];
  return plain([...held.filter(Boolean), last].join("+"));
}

/** One spelling of each shortcut. Signs carry their own Shift on some keyboards. */
function plain(shortcut: string): string {
  const parts = shortcut.split("+");
  const last = parts.pop() ?? "";
  const sign = last === "Plus" || (last.length === 1 && !/[a-z0-9]/i.test(last));
  const held = ["Mod", "Alt", "Shift"].filter(
    (part) => parts.includes(part) && !(sign && part === "Shift"),
  );
  return [...held, last.length === 1 ? last.toLowerCase() : last].join("+");
}

const same = (a: string, b: string) => plain(a) === plain(b);

/** Shortcuts that browsers use before a page receives them, or that people would miss most. */
const BROWSERS = new Set(
  [
    "t",
    "n",
    "w",
    "q",
    "r",
    "l",
    "p",
    "0",
    "=",
    "-",
    "Plus",
    "Tab",
    "F4",
    "Shift+t",
    "Shift+n",
    "Shift+w",
  ]
    .concat(["Shift+r", "Shift+i", "Shift+j", "Shift+Delete", "PageUp", "PageDown"])
    .map((keys) => `Mod+${keys}`)
    .concat([
      "F1",
      "F3",
      "F5",
      "F7",
      "F11",
      "F12",
      "Alt+F4",
      "Alt+Home",
      "Alt+d",
      "Alt+Tab",
      "Alt+Space",
    ]),
);
/** Matches keys that move within forms, lists and the canvas. */
const WALKING = /^(?:Shift\+)?(?:Tab|Enter|Escape|Space|Home|End|PageUp|PageDown|Arrow\w+|\/)$/;
const READERS = /^(?:Insert|Mod\+Alt\+.*|.*(?:Insert|NumLock|ScrollLock|Pause))$/;

/** Returns why these keys cannot be chosen; null when they are free. */
export function refusalOf(shortcut: string): string | null {
  const keys = plain(shortcut);
  const printed = printedKeys(keys).join(" ");
  if (/^Mod\+(?:Alt\+)?(?:Shift\+)?\.$/.test(keys)) return `${printed} is STOP's, always.`;
  if (BROWSERS.has(keys)) return `Browsers use ${printed} themselves.`;
  if (READERS.test(keys)) return `Screen readers and keyboards of some countries use ${printed}.`;
  if (WALKING.test(keys)) return `${printed} moves the focus without a mouse.`;
  return null;
}

/** Returns the edit actions that have these keys, other than `name` itself. */
export function takenBy(
  editActions: readonly EditAction[],
  name: string,
  shortcut: string,
): EditAction[] {
  return editActions.filter(
    (each) => each.name !== name && each.shortcuts.some((keys) => same(keys, shortcut)),
  );
}

/** The edit actions with the shortcuts that hold here. */
export function withOwn(
  editActions: readonly EditAction[],
  own: OwnShortcuts,
): readonly EditAction[] {
  if (Object.keys(own).length === 0) return editActions;
  return editActions.map((each) => {
    const shortcuts = own[each.name];
    return shortcuts === undefined ? each : { ...each, shortcuts };
  });
}

/**
 * Returns true if the keys can be changed. Those of the clipboard's own events cannot: browsers raise the events
 * for these keys alone.
 */
export const isChangeable = (editAction: EditAction): boolean => editAction.event === undefined;

/**
 * Returns the own shortcuts after an edit action got these keys; other edit actions lose them. Keys that are as they
 * came are not stored.
 */
export function assigned(
  editActions: readonly EditAction[],
  own: OwnShortcuts,
  name: string,
  shortcuts: readonly string[],
): OwnShortcuts {
  const next: Record<string, readonly string[]> = {};
  for (const each of withOwn(editActions, own)) {
    const now =
      each.name === name
        ? shortcuts
        : each.shortcuts.filter((keys) => !shortcuts.some((given) => same(keys, given)));
    const first = editActions.find((known) => known.name === each.name)?.shortcuts ?? [];
    if (now.join(" ") !== first.join(" ")) next[each.name] = now;
  }
  return next;
}

/** Reads the stored shortcuts, without those that are no longer possible. */
export function readOwn(editActions: readonly EditAction[], kept: unknown): OwnShortcuts {
  if (typeof kept !== "object" || kept === null) return {};
  let own: OwnShortcuts = {};
  for (const [name, shortcuts] of Object.entries(kept)) {
    const editAction = editActions.find((each) => each.name === name);
    if (editAction === undefined || !isChangeable(editAction) || !Array.isArray(shortcuts))
      continue;
    const fixed = editActions
      .filter((each) => !isChangeable(each))
      .flatMap((each) => each.shortcuts);
    const fit = shortcuts.filter(
      (keys): keys is string =>
        typeof keys === "string" &&
        keys.length < 40 &&
        (editAction.shortcuts.includes(keys) || refusalOf(keys) === null) &&
        !fixed.some((theirs) => same(theirs, keys)),
    );
    own = assigned(editActions, own, name, fit);
  }
  return own;
}

const STORAGE_KEY = "aa.shortcuts";
const listeners = new Set<() => void>();
let now: { readonly text: string | null; readonly own: OwnShortcuts } = { text: null, own: {} };

function keptText(): string | null {
  try {
    return localStorage.getItem(STORAGE_KEY);
  } catch {
    return now.text; // a browser that keeps nothing has them on this page
  }
}

function current(editActions: readonly EditAction[]): OwnShortcuts {
  const text = keptText();
  if (text !== now.text) {
    let kept: unknown = null;
    try {
      kept = JSON.parse(text ?? "null");
    } catch {
      // what cannot be read is as if it were not there
    }
    now = { text, own: readOwn(editActions, kept) };
  }
  return now.own;
}

export function keepOwn(own: OwnShortcuts): void {
  const text = JSON.stringify(own);
  now = { text, own };
  try {
    localStorage.setItem(STORAGE_KEY, text);
  } catch {
    // as above
  }
  for (const listener of [...listeners]) listener();
}

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  window.addEventListener("storage", listener); // another window of this device
  return () => {
    listeners.delete(listener);
    window.removeEventListener("storage", listener);
  };
}

/** The shortcuts that were changed on this device. */
export function useOwnShortcuts(editActions: readonly EditAction[]): OwnShortcuts {
  return useSyncExternalStore(subscribe, () => current(editActions));
}
