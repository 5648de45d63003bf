/** A link from a note to an action: chosen and shown by a click, a tap or Enter. */
import { createContext, use } from "react";
import type { Key } from "../../graph/model";
import type { NoteLink } from "../../graph/note-links";
import { isolated } from "../../words/isolated";
import style from "./note-text.module.css";

/** Where links lead. Without it they are words. */
export interface NoteLinks {
  /** What the action is called now; null when there is none. */
  target(link: NoteLink): { readonly key: Key; readonly label: string } | null;
  open(key: Key): void;
  /** The names that a link can have. */
  names(): readonly string[];
}

export const NoteLinksContext = createContext<NoteLinks | null>(null);

export function ActionLink({ link }: { link: NoteLink }) {
  const links = use(NoteLinksContext);
  if (links === null) return link.name;
  const target = links.target(link);
  if (target === null) {
    return (
      <span className={style.lost} title="No action, or more than one, is called so">
        {link.name}
      </span>
    );
  }
  return (
    <button
      type="button"
      className={`${style.link} nodrag`}
      title={`Show ${isolated(target.label)}`}
      onClick={(event) => {
        event.stopPropagation(); // else the note would be chosen
        links.open(target.key);
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      {target.label}
    </button>
  );
}
