/**
 * Reads and changes parts of JSON texts as they are spelled: parsing would turn `5.0` into `5`.
 *
 * The one JSON reader of the page. The syntax tree of the JSON editor would give the same places, but it comes
 * with the editor only, and parses some thirty times as slowly (1.8 MB: over a second).
 */

/** One member of an object or one item of a list, by the place of its value in the text. */
interface JsonPart {
  /** Null for items, and for a name that cannot be read. */
  readonly name: string | null;
  readonly from: number;
  readonly to: number;
}

const BLANK = /\s*/y;
const BETWEEN = /[\s,]*/y;
const COLON = /\s*:?\s*/y;

/** Returns the index after what the sticky `pattern` matches at `at`. */
function skip(text: string, at: number, pattern: RegExp): number {
  pattern.lastIndex = at;
  return pattern.test(text) ? pattern.lastIndex : at;
}

function endOfString(text: string, at: number): number {
  for (let i = at + 1; i < text.length; i += 1) {
    if (text[i] === "\\") i += 1;
    else if (text[i] === '"') return i + 1;
  }
  return text.length;
}

/** Returns the index after the JSON value that begins at `at`, with the blanks that follow a number or a word. */
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

function nameIn(text: string): string | null {
  try {
    return String(JSON.parse(text));
  } catch {
    return null;
  }
}

/**
 * Yields the members of the object, or the items of the list, that begins at `at`. Yields nothing for other
 * values, and what is there of a text that breaks off.
 */
function* partsOf(text: string, at: number): Generator<JsonPart> {
  const open = skip(text, at, BLANK);
  const isList = text[open] === "[";
  if (!isList && text[open] !== "{") return;
  let from = skip(text, open + 1, BETWEEN);
  while (from < text.length && text[from] !== "]" && text[from] !== "}") {
    let name: string | null = null;
    if (!isList) {
      if (text[from] !== '"') return;
      const end = endOfString(text, from);
      name = nameIn(text.slice(from, end));
      from = skip(text, end, COLON);
    }
    const to = endOfValue(text, from);
    yield { name, from, to };
    if (to <= from) return;
    from = skip(text, to, BETWEEN);
  }
}

/** Returns the members of the object that `text` is, each with its text, in order. */
function membersOf(text: string): [name: string, text: string][] {
  return [...partsOf(text, 0)].flatMap(({ name, from, to }): [string, string][] =>
    name === null ? [] : [[name, text.slice(from, to).trim()]],
  );
}

/** Returns the names of all members of the object that `text` is, in order. */
export function memberNames(text: string): string[] {
  return membersOf(text).map(([name]) => name);
}

/** Returns the text of the member `name` of the object that `text` is; null when it has none. */
export function memberText(text: string, name: string): string | null {
  return membersOf(text).find(([known]) => known === name)?.[1] ?? null;
}

/** Returns the object with one member set to a JSON text, in its place; without the member for null. */
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

/**
 * Returns the index at which the value begins that a JSON pointer (RFC 6901) leads to. Where the pointer leads
 * nowhere, it is that of the last value on the way there.
 */
export function pointedAt(text: string, pointer: string): number {
  let at = skip(text, 0, BLANK);
  for (const segment of pointer.split("/").slice(1)) {
    const wanted = segment.replaceAll("~1", "/").replaceAll("~0", "~");
    let index = 0;
    let found: JsonPart | null = null;
    for (const part of partsOf(text, at)) {
      if ((part.name ?? String(index)) === wanted) found = part;
      if (found !== null) break;
      index += 1;
    }
    if (found === null) break;
    at = found.from;
  }
  return at;
}
