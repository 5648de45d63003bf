/** The ready-made actions that people answer, or for which the runner waits. */

import titles from "../api/schema/ready-made-titles.json";

/** Names of ready-made actions for people, by the names by which the runner knows them. */
const READY_MADE: ReadonlyMap<string, string> = new Map(Object.entries(titles));

const WAITS: ReadonlySet<string> = new Set(["AaWait", "AaUntil"]);

interface Named {
  readonly name: string;
  readonly actor: string;
  readonly missing?: boolean | undefined;
}

/** Return whether no robot plays this action. */
export function isReadyMade({ name }: Pick<Named, "name">): boolean {
  return READY_MADE.has(name);
}

/** Return the name of an action as people read it: `AaConfirm` is *Confirm*. Fields have the name itself. */
export function shownName(name: string): string {
  return READY_MADE.get(name) ?? name;
}

/** Return the roles that a graph asks, sorted, without "" (nobody in particular). */
export function rolesIn(actions: readonly Named[]): string[] {
  const asking = actions.filter((each) => isReadyMade(each) && !WAITS.has(each.name));
  return [...new Set(asking.map(({ actor }) => actor).filter((actor) => actor !== ""))].sort();
}
