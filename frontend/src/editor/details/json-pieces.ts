/** JSON text as coloured pieces, and where in it an action stands. Pure. */

export interface Piece {
  readonly kind: "name" | "string" | "number" | "word" | "sign";
  readonly text: string;
}

const TOKEN = /("(?:[^"\\]|\\.)*")(\s*:)?|(-?\d[\d.eE+-]*)|(true|false|null)|([^"\dtfn-]+|.)/g;

function lineOf(line: string): Piece[] {
  const found: Piece[] = [];
  for (const [all, text, colon, number, word] of line.matchAll(TOKEN)) {
    if (text !== undefined) {
      found.push({ kind: colon === undefined ? "string" : "name", text });
      if (colon !== undefined) found.push({ kind: "sign", text: colon });
    } else if (number !== undefined) found.push({ kind: "number", text: number });
    else if (word !== undefined) found.push({ kind: "word", text: word });
    else found.push({ kind: "sign", text: all });
  }
  return found;
}

/** The lines of a pretty-printed JSON text. */
export function pieces(text: string): Piece[][] {
  return text.trimEnd().split("\n").map(lineOf);
}

/**
 * First and last line (from 0) of an action in canonical text: indent 2, so that an action's braces
 * stand at 4 and its members at 6.
 */
export function rangeOf(text: string, name: string, instance: number): [number, number] | null {
  const lines = text.split("\n");
  const wanted = `"name": ${JSON.stringify(name)}`;
  const number = `"instance_id": ${instance}`;
  let start = -1;
  let named = false;
  let numbered = false;
  for (const [i, line] of lines.entries()) {
    if (/^ {4}\{/.test(line)) [start, named, numbered] = [i, false, false];
    else if (start >= 0 && /^ {6}"/.test(line)) {
      const member = line.trim().replace(/,$/, "");
      if (member === wanted) named = true;
      else if (member === number) numbered = true;
    } else if (/^ {4}\}/.test(line)) {
      const noNumber = !lines
        .slice(start, i)
        .some((other) => other.startsWith('      "instance_id"'));
      const body = lines
        .slice(start, i)
        .some((other) => /^ {6}"(type|parents|children)"/.test(other));
      if (named && body && (numbered || (noNumber && instance === 0))) return [start, i];
      start = -1;
    }
  }
  return null;
}
