/** Finds the lines of actions and arrows in the JSON text of a graph. Lines count from 0. Pure. */
import { pointedAt } from "../../graph/json-members";
import { type Action, ENTRY, EXIT, type Graph, type Relation } from "../../graph/model";

export type Lines = readonly [first: number, last: number];

/**
 * The lines of an action in canonical text: indent 2, so that an action's braces stand at 4 and its
 * members at 6. Null when it is not there.
 */
export function rangeOf(
  lines: readonly string[],
  { name, instanceId }: Pick<Action, "name" | "instanceId">,
): Lines | null {
  const wanted = `"name": ${JSON.stringify(name)}`;
  const number = `"instance_id": ${instanceId}`;
  for (const [first, last] of blocks(lines)) {
    const members = lines
      .slice(first, last)
      .filter((line) => /^ {6}"/.test(line))
      .map((line) => line.trim().replace(/,$/, ""));
    const isAction = members.some((line) => /^"(type|parents|children)"/.test(line));
    const numbered = members.some((line) => line.startsWith('"instance_id"'));
    const fits = members.includes(number) || (!numbered && instanceId === 0);
    if (isAction && members.includes(wanted) && fits) return [first, last];
  }
  return null;
}

/** The lines of an arrow in canonical text, where the action that it comes from names its end. */
export function rangeOfArrow(graph: Graph, text: string, relation: Relation): Lines | null {
  const { parent, child } = relation;
  const end = child === EXIT;
  const siblings = graph.relations
    .filter((other) =>
      end ? other.child === EXIT : other.parent === parent && other.child !== EXIT,
    )
    .filter(({ only }) => only !== (end ? "children" : "parents"))
    .sort((a, b) => (end ? a.childOrder - b.childOrder : a.parentOrder - b.parentOrder));
  const at = siblings.indexOf(relation);
  const action = graph.actions.filter(({ missing }) => !missing).findIndex((a) => a.key === parent);
  if (at < 0 || (!end && parent !== ENTRY && action < 0)) return null;
  const list = end
    ? "/graph_exit"
    : parent === ENTRY
      ? "/graph_entry"
      : `/actions/${action}/children`;
  const first = lineOf(text, `${list}/${at}`);
  const lines = text.split("\n");
  const indent = /^ */.exec(lines[first] ?? "")?.[0] ?? "";
  if (!lines[first]?.startsWith(`${indent}{`)) return null;
  const last = lines.findIndex((line, i) => i >= first && line.startsWith(`${indent}}`));
  return last < 0 ? null : [first, last];
}

/** The action in whose block a line stands. */
export function actionAt(graph: Graph, lines: readonly string[], line: number): Action | null {
  for (const [first, last] of blocks(lines)) {
    if (line < first || line > last) continue;
    const member = (name: string) =>
      lines.slice(first, last).find((text) => text.startsWith(`      "${name}": `));
    const name = member("name")?.trim().replace(/,$/, "").slice('"name": '.length);
    const number = member("instance_id")?.match(/\d+/)?.[0] ?? "0";
    const found = graph.actions.find(
      (action) => JSON.stringify(action.name) === name && action.instanceId === Number(number),
    );
    return found ?? null;
  }
  return null;
}

function* blocks(lines: readonly string[]): Generator<Lines> {
  let first = -1;
  for (const [i, line] of lines.entries()) {
    if (line.startsWith("    {")) first = i;
    else if (line.startsWith("    }") && first >= 0) {
      yield [first, i];
      first = -1;
    }
  }
}

/** Returns the line, from 0, to which a JSON pointer (RFC 6901) leads, or the last one on the way there. */
export function lineOf(text: string, path: string): number {
  return text.slice(0, pointedAt(text, path)).split("\n").length - 1;
}
