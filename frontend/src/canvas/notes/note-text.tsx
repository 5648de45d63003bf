/** The text of a note, and the completion of links in its field; both load their larger half late. */
import { lazy, Suspense } from "react";
import { spokenNote } from "../../graph/note-links";
import { boundedPart } from "../../ui/lazy-part";
import style from "./note-text.module.css";

const Markdown = lazy(() => import("./markdown"));
const PLAIN = /^[^*_`#[\]<>\\~|&!\n-]*$/;
const LISTED = /^\s*(?:[-+*]|\d{1,9}[.)])\s/m;
const ADDRESSED = /https?:/;

/** Return whether a text may contain Markdown; most notes are a line or two of plain words. */
export function isMarkedUp(text: string): boolean {
  return !PLAIN.test(text) || LISTED.test(text) || ADDRESSED.test(text);
}

/** Shows a note as plain text until the Markdown renderer is loaded. */
export function NoteText({ text }: { text: string }) {
  const plain = <p className={style.plain}>{spokenNote(text)}</p>;
  if (!isMarkedUp(text)) return plain;
  return (
    <Suspense fallback={plain}>
      <Markdown text={text} />
    </Suspense>
  );
}

/** Completes links in a field once that part is loaded. */
export const LinkNames = boundedPart(
  () => import("./link-completion").then((part) => part.LinkCompletion),
  { waiting: null, frame: () => null },
);
