/** Brings the keyboard to something that may still be on its way to the page. */
import { isStopKey, keyOf } from "./keys";

const PATIENCE = 60; // frames: about a second

const WRITABLE = "input:not([type=hidden]), textarea, button, [contenteditable=true]";

/** Calls back with the first that a selector finds, in the next frame or as soon as it is there. */
export function whenThere(
  selector: string,
  then: (found: HTMLElement) => void,
  patience = PATIENCE,
): void {
  requestAnimationFrame(() => {
    const found = document.querySelector<HTMLElement>(selector);
    if (found !== null) then(found);
    else if (patience > 0) whenThere(selector, then, patience - 1);
  });
}

/**
 * Puts the focus into a field once it is there. `id`: its `data-field`. A field without anything to write in is shown
 * only.
 */
export function focusField(id: string): void {
  // First goes what stands in the place of the form: a list of problems has such fields, too.
  requestAnimationFrame(() => whenThere(`[data-field="${CSS.escape(id)}"]`, focusIn));
}

function focusIn(field: HTMLElement): void {
  field.scrollIntoView({ block: "center" });
  const inputs = [...field.querySelectorAll<HTMLElement>(WRITABLE)];
  (inputs.find((each) => each.matches("input, textarea")) ?? inputs[0])?.focus({
    preventScroll: true,
  });
}

const TEXT_FIELDS =
  "textarea, select, [contenteditable=true], input:not([type=radio], [type=checkbox], [type=range], [type=button])";

const isWritable = (target: EventTarget | null): target is HTMLElement =>
  target instanceof HTMLElement && target.matches(TEXT_FIELDS);

/** Keys that end the rest: their person has seen where the keyboard is. */
const MEANT = new Set(["Escape", "Tab", "F6"]);
/** Keys that say nothing by themselves. */
const HELD = new Set(["Shift", "Control", "Alt", "Meta", "AltGraph", "CapsLock", "NumLock"]);

/**
 * Ignores keys after the field with the focus was removed, since they would be shortcuts. `onRest` is called with the
 * first of them. Returns how to end it.
 */
export function restAfterLostFields(onRest: () => void): () => void {
  /** The field in which a person types, or typed until it was removed. */
  let field: HTMLElement | null = null;
  let isTold = false;
  const end = () => {
    field = null;
    isTold = false;
  };
  const isLost = () => field !== null && !field.isConnected && !isWritable(document.activeElement);
  const onFocus = ({ target }: FocusEvent) => {
    if (!isWritable(target)) return;
    end();
    field = target;
  };
  const onBlur = () => {
    const left = field;
    // A field that is taken away loses the focus before it is away; a window takes the focus with it.
    queueMicrotask(() => {
      if (left === field && left?.isConnected && document.activeElement !== left) end();
    });
  };
  const onInput = ({ target }: Event) => {
    if (isWritable(target)) field = target;
  };
  const onKey = (event: KeyboardEvent) => {
    const key = keyOf(event);
    if (isStopKey(event)) return;
    if (!isLost()) {
      // What these do to a field is meant, also where it goes by that; what is typed later is not.
      if (isWritable(event.target) && (key === "Enter" || MEANT.has(key))) end();
      return;
    }
    if (MEANT.has(key)) return end();
    if (HELD.has(key)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (!isTold) onRest();
    isTold = true;
  };
  const onClipboard = (event: Event) => {
    if (isLost()) event.stopImmediatePropagation();
  };
  const asking = new AbortController();
  const options = { capture: true, signal: asking.signal };
  window.addEventListener("focusin", onFocus, options);
  window.addEventListener("focusout", onBlur, options);
  window.addEventListener("input", onInput, options);
  window.addEventListener("pointerdown", end, options);
  window.addEventListener("keydown", onKey, options);
  for (const kind of ["cut", "copy", "paste"]) window.addEventListener(kind, onClipboard, options);
  return () => asking.abort();
}
