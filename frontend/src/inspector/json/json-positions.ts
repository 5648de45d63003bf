/** Where something stands in the JSON text of a graph. Lines count from 0. Pure. */
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

/** The line to which a JSON pointer (RFC 6901) leads, or the last one on the way there. */
export function lineOf(text: string, path: string): number {
  const segments = path
    .split("/")
    .slice(1)
    .map((segment) => segment.replaceAll("~1", "/").replaceAll("~0", "~"));
  let at = skip(text, 0);
  for (const segment of segments) {
    const next = text[at] === "[" ? itemOf(text, at, Number(segment)) : memberOf(text, at, segment);
    if (next === null) break;
    at = next;
  }
  return text.slice(0, at).split("\n").length - 1;
}

const BLANK = /[\s,:]*/y;
const STRING = /"(?:[^"\\]|\\.)*"/y;
const WORD = /[^\s,:[\]{}"]+/y;

function skip(text: string, at: number, pattern = BLANK): number {
  pattern.lastIndex = at;
  return pattern.test(text) ? pattern.lastIndex : at;
}

/** The index after the value that begins at `at`. */
function after(text: string, at: number): number {
  const c = text[at];
  if (c === '"') return skip(text, at, STRING);
  if (c !== "{" && c !== "[") return skip(text, at, WORD);
  let i = skip(text, at + 1);
  while (i < text.length && text[i] !== "}" && text[i] !== "]") {
    const next = skip(text, after(text, i));
    if (next <= i) return text.length;
    i = next;
  }
  return i + 1;
}

function itemOf(text: string, at: number, index: number): number | null {
  let i = skip(text, at + 1);
  for (let n = 0; n < index && text[i] !== "]" && i < text.length; n += 1) {
    i = skip(text, after(text, i));
  }
  return i < text.length && text[i] !== "]" ? i : null;
}

function memberOf(text: string, at: number, name: string): number | null {
  if (text[at] !== "{") return null;
  let i = skip(text, at + 1);
  while (text[i] === '"') {
    const end = skip(text, i, STRING);
    const value = skip(text, end);
    if (nameIn(text.slice(i, end)) === name) return value;
    i = skip(text, after(text, value));
  }
  return null;
}

function nameIn(text: string): string | null {
  try {
    return String(JSON.parse(text));
  } catch {
    return null;
  }
}
