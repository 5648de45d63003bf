/** Actions on their levels as people read them, and as a run calls them. Pure. */
import type { Run } from "../api/runs";
import { type LevelPlace, partOf, placesOf } from "./level-places";

/** Between the levels, as people read them. */
export const INTO = " › ";

/** How a run calls the last of a way of actions, each inside of the one before. */
export function factOf(graph: string, way: readonly string[]): string {
  const [last = "", ...above] = [...way].reverse();
  if (above.length === 0) return last;
  return `${above.reverse().reduce(partOf, graph)}/${last}`;
}

/** An action as people call it: `Grip_0` is Grip 0. */
export function spaced(fullName: string): string {
  return fullName.replace(/_(\d+)$/, " $1");
}

/** The way to an action, in words. */
export function wayWords({ levels, name }: Pick<LevelPlace, "levels" | "name">): string {
  return [...levels, name].map(spaced).join(INTO);
}

/** An action of a run in words, with the actions that it is inside of: `Round__Fetch__0/Lift_0` is Fetch 0 › Lift 0. */
export function actionWords(run: Run, name: string): string {
  return wayWords(placesOf(run).get(name) ?? { levels: [], name });
}
