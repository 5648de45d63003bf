/** The text of a note: plain until the reader of Markdown is there, and wherever it is too odd for that. */
import { lazy, Suspense } from "react";
import { spokenNote } from "../../graph/note-links";
import style from "./note-text.module.css";

const Markdown = lazy(() => import("./markdown"));
const PLAIN = /^[^*_`#[\]<>\\~|&!\n-]*$/;
const LISTED = /^\s*(?:[-+*]|\d{1,9}[.)])\s/m;
const ADDRESSED = /https?:/;

/** Whether there is anything in it but words: most notes are a line or two. */
export function isMarkedUp(text: string): boolean {
  return !PLAIN.test(text) || LISTED.test(text) || ADDRESSED.test(text);
}

export function NoteText({ text }: { text: string }) {
  const plain = <p className={style.plain}>{spokenNote(text)}</p>;
  if (!isMarkedUp(text)) return plain;
  return (
    <Suspense fallback={plain}>
      <Markdown text={text} />
    </Suspense>
  );
}
