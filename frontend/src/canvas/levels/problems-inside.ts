/** What is wrong with the graph on the canvas, for what is drawn of graphs inside. */
import type { ToldProblem } from "../../graph/problems/told-problems";
import { Watched } from "../../ui/watched";

/** One for the page: there is one canvas. */
export const toldOnCanvas = new Watched<readonly ToldProblem[]>([]);
