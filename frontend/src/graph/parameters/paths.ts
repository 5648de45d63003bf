/** Names of parameters: as typed, as paths. Pure. */
import type { Parameter } from "../model";

/** `pose.position.x` as a path. */
export function pathFrom(words: string): string {
  return words
    .trim()
    .split(".")
    .filter((part) => part !== "")
    .map((part) => part.replaceAll("~", "~0").replaceAll("/", "~1"))
    .join("/");
}

/** Why a path cannot be used for one more parameter; null when it can. */
export function taken(list: readonly Parameter[], path: string): string | null {
  if (path === "") return "A parameter has a name.";
  const same = list.some((other) => other.path === path);
  if (same) return "There is one of this name.";
  const within = list.some(
    (other) => other.path.startsWith(`${path}/`) || path.startsWith(`${other.path}/`),
  );
  return within ? "This is a group of others." : null;
}
