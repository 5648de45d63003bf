/**
 * Links from notes to actions: `[[Drive 0]]`, which becomes `[[Drive 0#id]]` once it is written.
 *
 * By its id a link finds an action whatever it is called by then; the name beside it is for those who
 * read the text as it is, such as programs that know no notes.
 */
import type { Action, Graph, Key } from "./model";

/** Matches a link; `id` is empty while it has only a name. */
const LINK = /\[\[([^[\]\n#]{1,200})(?:#([A-Za-z0-9]{12}))?\]\]/g;

export interface NoteLink {
  readonly name: string;
  readonly id: Key | "";
}

/** A text in pieces: words, and links between them. */
export function linkPieces(text: string): (string | NoteLink)[] {
  const pieces: (string | NoteLink)[] = [];
  let end = 0;
  for (const match of text.matchAll(LINK)) {
    if (match.index > end) pieces.push(text.slice(end, match.index));
    pieces.push({ name: (match[1] ?? "").trim(), id: match[2] ?? "" });
    end = match.index + match[0].length;
  }
  if (end < text.length) pieces.push(text.slice(end));
  return pieces;
}

type Actions = Graph["actions"];

/**
 * Returns the action that a link leads to. A name alone must be that of one action: `Drive` where there is one,
 * else `Drive 0`.
 */
export function linkedAction(actions: Actions, { name, id }: NoteLink): Action | null {
  if (id !== "") return actions.find(({ key }) => key === id) ?? null;
  const found = actions.filter((action) => nameOf(action) === name || action.name === name);
  const exact = found.filter((action) => nameOf(action) === name);
  const [only, ...others] = exact.length > 0 ? exact : found;
  return others.length === 0 ? (only ?? null) : null;
}

const nameOf = ({ name, instanceId }: Action) => `${name} ${instanceId}`;

/** The text with an id in every link whose name says which action is meant, and with names of today. */
export function withLinkIds(text: string, actions: Actions): string {
  return linkPieces(text)
    .map((piece) => {
      if (typeof piece === "string") return piece;
      const action = linkedAction(actions, piece);
      if (action !== null && !/[[\]#\n]/.test(action.name)) {
        return `[[${nameOf(action)}#${action.key}]]`;
      }
      return `[[${piece.name}${piece.id === "" ? "" : `#${piece.id}`}]]`;
    })
    .join("");
}

/** Returns the text as people read it: names without ids. */
export function spokenNote(text: string): string {
  return text.replace(LINK, "$1");
}

/** The link that is being written before the caret. */
export interface OpenLink {
  /** The index at which its `[[` begins. */
  readonly at: number;
  /** The part of the name that is written so far. */
  readonly typed: string;
}

/** Returns the link in which the caret stands; null before `[[`, and after a character that no name has. */
export function openLink(text: string, caret: number): OpenLink | null {
  const at = text.slice(0, caret).lastIndexOf("[[");
  const typed = text.slice(at + 2, caret);
  return at < 0 || typed.length > 200 || /[[\]\n#]/.test(typed) ? null : { at, typed };
}

/** Matches the rest, after the caret, of a link that was written before. */
const REST = /^(?:[^[\]\n]{0,220}\]\]|\]?)/;

/** Returns the text of a link, and the index up to which it replaces the present text. */
export function linkText(text: string, caret: number, name: string): { text: string; end: number } {
  const closed = REST.exec(text.slice(caret))?.[0].length ?? 0;
  return { text: `[[${name}]]`, end: caret + closed };
}

/** The names by which a link finds one action, and only that. */
export function linkableNames(actions: Actions): string[] {
  const names = actions.filter(({ missing }) => !missing).map(nameOf);
  const count = new Map<string, number>();
  for (const name of names) count.set(name, (count.get(name) ?? 0) + 1);
  return names.filter((name) => {
    const [link, ...others] = linkPieces(`[[${name}]]`);
    const whole = others.length === 0 && typeof link === "object" && link.name === name;
    return whole && link.id === "" && count.get(name) === 1;
  });
}
