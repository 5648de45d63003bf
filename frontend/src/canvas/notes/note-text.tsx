/** The text of a note, and the completion of links in its field; both load their larger half late. */
import { type ComponentProps, lazy, Suspense } from "react";
import { spokenNote } from "../../graph/note-links";
import { lazyPart, PartBoundary } from "../../ui/lazy-part";
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

const LinkCompletion = lazyPart(() =>
  import("./link-completion").then((part) => part.LinkCompletion),
);
const nothing = () => null;

/** Completes links in a field once that part is loaded. */
export function LinkNames(props: ComponentProps<typeof LinkCompletion>) {
  return (
    <PartBoundary frame={nothing} waiting={null}>
      <LinkCompletion {...props} />
    </PartBoundary>
  );
}
