/** The colours of notes and frames, in tokens that fit both themes. */
import type { NoteColor } from "../../graph/edit/notes";

export const noteColor: Readonly<Record<NoteColor, string>> = {
  grey: "var(--ink3)",
  amber: "var(--false)",
  green: "var(--true)",
  blue: "var(--run)",
  violet: "var(--stopped)",
  red: "var(--error)",
};
