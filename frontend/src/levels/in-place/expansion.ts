/** What is expanded on the canvas, outside of React: whatever draws a level looks here for its own. */
import type { Key } from "../../graph/model";
import { Watched } from "../../ui/watched";
import type { LevelGraph } from "./level-graph";

interface Expansion {
  /** By the actions of the graph on the canvas. */
  readonly levels: ReadonlyMap<Key, LevelGraph>;
  toggle(path: string): void;
  enter(path: string): void;
}

export const expansion = new Watched<Expansion>({
  levels: new Map(),
  toggle: () => {},
  enter: () => {},
});
