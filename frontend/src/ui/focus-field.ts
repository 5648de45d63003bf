/** Brings the keyboard to something that may still be on its way to the page. */

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

/** `id`: what stands in `data-field`. A field without anything to write in is shown only. */
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
