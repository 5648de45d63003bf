/** The ready-made actions that people answer, or for which the runner waits. */

/** Names by which the runner knows them, and what people call them. */
export const READY_MADE: ReadonlyMap<string, string> = new Map([
  ["AaConfirm", "Confirm"],
  ["AaChoose", "Choose"],
  ["AaAskText", "Ask for a text"],
  ["AaAskNumber", "Ask for a number"],
  ["AaAskPhoto", "Ask for a photo"],
  ["AaWait", "Wait"],
  ["AaUntil", "Until a time"],
]);

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

/** Return the roles that a graph asks, sorted, without "" (nobody in particular). */
export function rolesIn(actions: readonly Named[]): string[] {
  const asking = actions.filter((each) => isReadyMade(each) && !WAITS.has(each.name));
  return [...new Set(asking.map(({ actor }) => actor).filter((actor) => actor !== ""))].sort();
}
