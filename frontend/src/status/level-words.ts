/** Actions on their levels as people read them, and as a run calls them. Pure. */
import { type LevelPlace, partOf } from "./level-places";

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
