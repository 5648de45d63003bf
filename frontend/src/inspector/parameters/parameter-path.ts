/** Names of parameters: as typed, as paths, in groups. Pure. */
import type { Parameter } from "../../graph/model";

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

export interface Family {
  /** What the paths begin with, with the slash at its end; empty for those in no group. */
  readonly prefix: string;
  readonly members: readonly Parameter[];
}

/** Neighbours of one group together, in the order of the list. */
export function families(list: readonly Parameter[]): Family[] {
  const found: { prefix: string; members: Parameter[] }[] = [];
  for (const parameter of list) {
    const prefix = parameter.path.slice(0, parameter.path.lastIndexOf("/") + 1);
    const last = found.at(-1);
    if (last && last.prefix === prefix) last.members.push(parameter);
    else found.push({ prefix, members: [parameter] });
  }
  return found;
}
