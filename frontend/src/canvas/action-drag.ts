/** Drags actions from the library to the canvas. */
import type { NewAction } from "../graph/edit";
import { PointerDrag } from "../ui/pointer-drag";

export const actionDrag = new PointerDrag<NewAction>();
