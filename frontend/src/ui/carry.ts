/** Carries actions from the list to the canvas. */
import type { NewAction } from "../graph/edit";
import { Carrier } from "./placing";

export const actionCarrier = new Carrier<NewAction>();
