/** Brings the keyboard to a field that may still be on its way to the page. */

const PATIENCE = 60; // frames: about a second

const WRITABLE = "input:not([type=hidden]), textarea, button, [contenteditable=true]";

/** `id`: what stands in `data-field`. A field without anything to write in is shown only. */
export function focusField(id: string): void {
  // First goes what stands in the place of the form: a list of problems has such fields, too.
  requestAnimationFrame(() => find(id, PATIENCE));
}

function find(id: string, patience: number): void {
  const field = document.querySelector<HTMLElement>(`[data-field="${CSS.escape(id)}"]`);
  if (field === null) {
    if (patience > 0) requestAnimationFrame(() => find(id, patience - 1));
    return;
  }
  field.scrollIntoView({ block: "center" });
  const inputs = [...field.querySelectorAll<HTMLElement>(WRITABLE)];
  (inputs.find((each) => each.matches("input, textarea")) ?? inputs[0])?.focus({
    preventScroll: true,
  });
}
