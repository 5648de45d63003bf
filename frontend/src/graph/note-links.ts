/**
 * Links from notes to actions: `[[Drive 0]]`, which becomes `[[Drive 0#id]]` once it is written.
 *
 * By its id a link finds an action whatever it is called by then; the name beside it is for those who
 * read the text as it is, such as programs that know no notes.
 */
import type { Action, Graph, Key } from "./model";

/** A link as it is written; `id` is empty as long as it has only a name. */
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

/** What a link leads to. A name alone must be that of one action: `Drive` where there is one, else `Drive 0`. */
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

/** The text as it is said and listed: names without ids. */
export function spokenNote(text: string): string {
  return text.replace(LINK, "$1");
}
