/** Carries actions from the list to the canvas. */
import type { NewAction } from "../graph/edit";
import { Carrier } from "../ui/pointer-drag";

export const actionCarrier = new Carrier<NewAction>();
