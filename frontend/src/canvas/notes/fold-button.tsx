/** The button in the title of a frame that folds it, and unfolds it again. */
import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { createContext, use } from "react";
import type { Note } from "../../graph/edit/notes";
import style from "./fold-button.module.css";

/** How frames are folded; without it they are shown as they are. */
export type FoldFrame = (key: string, folded: boolean) => void;

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
