/** Buttons within notes: a link to an action, and the button that folds a frame. */

import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { createContext, use } from "react";
import type { Note } from "../../graph/edit/notes";
import type { Key } from "../../graph/model";
import type { NoteLink } from "../../graph/note-links";
import { isolated } from "../../words/isolated";
import style from "./note-text.module.css";

/** Resolves links in notes; without it links are shown as text. */
export interface NoteLinks {
  /** Returns the action of a link with its current name; null if there is none. */
  target(link: NoteLink): { readonly key: Key; readonly label: string } | null;
  open(key: Key): void;
  /** Returns the names that a link can have. */
  names(): readonly string[];
}

export const NoteLinksContext = createContext<NoteLinks | null>(null);

/** Shows a link to an action by its current name; a click selects and shows the action. */
export function ActionLink({ link }: { link: NoteLink }) {
  const links = use(NoteLinksContext);
  if (links === null) return link.name;
  const target = links.target(link);
  if (target === null) {
    return (
      <span className={style.lost} title="No action, or more than one, has this name">
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
        event.stopPropagation(); // else the click would select the note
        links.open(target.key);
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      {target.label}
    </button>
  );
}

/** Folds or unfolds a frame; without it frames have no button for that. */
type FoldFrame = (key: string, folded: boolean) => void;

export const FoldFrameContext = createContext<FoldFrame | null>(null);

/** The button in the title of a frame that folds or unfolds it. */
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
        event.stopPropagation(); // else the click would select the frame
        fold(note.key, !folded);
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      <Sign aria-hidden />
    </button>
  );
}
