/** Members of JSON texts as they are spelled: parsing would turn `5.0` into `5`. */

/** The index after the JSON value that begins at `at`. The text must be valid JSON. */
function endOfValue(text: string, at: number): number {
  let depth = 0;
  for (let i = at; i < text.length; i += 1) {
    const c = text[i];
    if (c === '"') {
      i = endOfString(text, i) - 1;
      if (depth === 0) return i + 1;
    } else if (c === "{" || c === "[") {
      depth += 1;
    } else if (c === "}" || c === "]") {
      if (depth === 0) return i;
      depth -= 1;
      if (depth === 0) return i + 1;
    } else if (c === "," && depth === 0) {
      return i;
    }
  }
  return text.length;
}

function endOfString(text: string, at: number): number {
  for (let i = at + 1; i < text.length; i += 1) {
    if (text[i] === "\\") i += 1;
    else if (text[i] === '"') return i + 1;
  }
  return text.length;
}

function skip(text: string, at: number, pattern: RegExp): number {
  pattern.lastIndex = at;
  return pattern.test(text) ? pattern.lastIndex : at;
}

const COLON = /\s*:\s*/y;
const BLANK = /[\s,:{]*/y;

/** The members of the object that `text` is, each with its text, in order. */
function membersOf(text: string): [name: string, text: string][] {
  const found: [string, string][] = [];
  let at = skip(text, 0, BLANK);
  while (text[at] === '"') {
    const afterKey = endOfString(text, at);
    const name = String(JSON.parse(text.slice(at, afterKey)));
    const start = skip(text, afterKey, COLON);
    const end = endOfValue(text, start);
    found.push([name, text.slice(start, end).trim()]);
    at = skip(text, end, BLANK);
  }
  return found;
}

/** The names of all members of the object that `text` is, in order. */
export function memberNames(text: string): string[] {
  return membersOf(text).map(([name]) => name);
}

/** The text of the member `name` of the object that `text` is; null when it has none. */
export function memberText(text: string, name: string): string | null {
  return membersOf(text).find(([known]) => known === name)?.[1] ?? null;
}

/** The object with one member set to a JSON text, in its place; with null, without it. */
export function withMember(text: string, name: string, value: string | null): string {
  const members = membersOf(text);
  const known = members.some(([other]) => other === name);
  const next = known
    ? members.flatMap(([other, old]): [string, string][] =>
        other !== name ? [[other, old]] : value === null ? [] : [[name, value]],
      )
    : value === null
      ? members
      : [...members, [name, value] as [string, string]];
  return `{${next.map(([key, member]) => `${JSON.stringify(key)}: ${member}`).join(", ")}}`;
}
