/** Buttons within notes: a link to an action, and the button that folds a frame. */

import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { createContext, use } from "react";
import type { Note } from "../../graph/edit/notes";
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

/** How frames are folded; without it they are shown as they are. */
type FoldFrame = (key: string, folded: boolean) => void;

export const FoldFrameContext = createContext<FoldFrame | null>(null);

export function FoldButton({ note, folded }: { note: Note; folded: boolean }) {
  const fold = use(FoldFrameContext);
  if (fold === null) return null;
  const Sign = folded ? IconChevronRight : IconChevronDown;
  return (
    <button
      type="button"
      className={`${style.fold} nodrag`}
      aria-label={`Contents of ${note.text || "the frame"}`}
      aria-expanded={!folded}
      title={folded ? "Unfold" : "Fold"}
      onClick={(event) => {
        event.stopPropagation(); // the frame is chosen by what comes of it
        fold(note.key, !folded);
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      <Sign aria-hidden />
    </button>
  );
}
