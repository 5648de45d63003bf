/** Carries actions from the list to the canvas. */
import type { NewAction } from "../graph/edit";
import { PointerDrag } from "../ui/pointer-drag";

export const actionDrag = new PointerDrag<NewAction>();
