/** JSON text that can be edited: colours, folding, marks at lines. Loaded when it is first seen. */
import { defaultKeymap, history, historyKeymap } from "@codemirror/commands";
import { json } from "@codemirror/lang-json";
import { bracketMatching, foldGutter, foldKeymap, syntaxHighlighting } from "@codemirror/language";
import { type Diagnostic, lintGutter, setDiagnostics } from "@codemirror/lint";
import { highlightSelectionMatches, search, searchKeymap } from "@codemirror/search";
import {
  Annotation,
  Compartment,
  EditorState,
  type Extension,
  RangeSetBuilder,
  StateEffect,
  StateField,
} from "@codemirror/state";
import {
  Decoration,
  type DecorationSet,
  drawSelection,
  EditorView,
  highlightActiveLine,
  keymap,
  lineNumbers,
} from "@codemirror/view";
import { classHighlighter } from "@lezer/highlight";
import { useEffect, useRef } from "react";
import type { Lines } from "./json-positions";
import style from "./json-view.module.css";

export interface JsonError {
  /** The line, counted from 0. */
  readonly line: number;
  /** The column, counted from 0; null for the whole line. */
  readonly column: number | null;
  readonly message: string;
  readonly severity: "error" | "warning";
}

interface Props {
  text: string;
  readOnly: boolean;
  faults: readonly JsonError[];
  /** The lines of what is selected in the graph. */
  marked: Lines | null;
  onChange: (text: string) => void;
  /** The person put the cursor on this line. */
  onLine: (line: number) => void;
  onApply: () => void;
}

/** Text that came from elsewhere, not from the keyboard. */
const Given = Annotation.define<true>();
const setMark = StateEffect.define<Lines | null>();
const row = Decoration.line({ class: style.marked ?? "" });

const marks = StateField.define<DecorationSet>({
  create: () => Decoration.none,
  update(set, transaction) {
    let now = set.map(transaction.changes);
    for (const effect of transaction.effects) {
      if (!effect.is(setMark)) continue;
      const rows = new RangeSetBuilder<Decoration>();
      const { doc } = transaction.state;
      const [first, last] = effect.value ?? [0, -1];
      for (let i = first; i <= Math.min(last, doc.lines - 1); i += 1) {
        rows.add(doc.line(i + 1).from, doc.line(i + 1).from, row);
      }
      now = rows.finish();
    }
    return now;
  },
  provide: (field) => EditorView.decorations.from(field),
});

/** The one piece in which the two texts differ, so that cursor and folds stay. */
function replacement(old: string, next: string) {
  let from = 0;
  const most = Math.min(old.length, next.length);
  while (from < most && old[from] === next[from]) from += 1;
  let end = 0;
  while (end < most - from && old[old.length - 1 - end] === next[next.length - 1 - end]) end += 1;
  return { from, to: old.length - end, insert: next.slice(from, next.length - end) };
}

function diagnosticsOf(state: EditorState, faults: readonly JsonError[]): Diagnostic[] {
  return faults.map(({ line, column, message, severity }) => {
    const { from, to } = state.doc.line(Math.min(line + 1, state.doc.lines));
    const at = column === null ? from : Math.min(from + column, to);
    return { from: at, to, message, severity };
  });
}

const readonly = new Compartment();

function extensions(now: { readonly current: Props }): Extension {
  return [
    lineNumbers(),
    foldGutter(),
    lintGutter(),
    history(),
    drawSelection(),
    bracketMatching(),
    highlightActiveLine(),
    highlightSelectionMatches(),
    search({ top: true }),
    json(),
    syntaxHighlighting(classHighlighter),
    marks,
    EditorState.tabSize.of(2),
    EditorView.contentAttributes.of({
      "aria-label": "JSON of the graph",
      "aria-multiline": "true",
      tabindex: "0",
      "data-own-keys": "true",
      spellcheck: "false",
    }),
    keymap.of([
      {
        key: "Mod-Enter",
        run: () => {
          now.current.onApply();
          return true;
        },
      },
      ...defaultKeymap,
      ...historyKeymap,
      ...foldKeymap,
      ...searchKeymap,
    ]),
    EditorView.updateListener.of((update) => {
      const given = update.transactions.some((transaction) => transaction.annotation(Given));
      if (update.docChanged && !given) now.current.onChange(update.state.doc.toString());
      if (update.transactions.some((transaction) => transaction.isUserEvent("select"))) {
        const { doc, selection } = update.state;
        now.current.onLine(doc.lineAt(selection.main.head).number - 1);
      }
    }),
  ];
}

export default function JsonEditor(props: Props) {
  const { text, readOnly, faults, marked } = props;
  const frame = useRef<HTMLDivElement>(null);
  const view = useRef<EditorView | null>(null);
  const now = useRef(props);
  now.current = props;

  useEffect(() => {
    if (frame.current === null) return;
    const state = EditorState.create({
      doc: now.current.text,
      extensions: [extensions(now), readonly.of(EditorState.readOnly.of(now.current.readOnly))],
    });
    view.current = new EditorView({ state, parent: frame.current });
    return () => view.current?.destroy();
  }, []);
  useEffect(() => {
    const old = view.current?.state.doc.toString();
    if (old === undefined || old === text) return;
    view.current?.dispatch({ changes: replacement(old, text), annotations: Given.of(true) });
  }, [text]);
  useEffect(() => {
    view.current?.dispatch({
      effects: readonly.reconfigure(EditorState.readOnly.of(readOnly)),
    });
  }, [readOnly]);
  useEffect(() => {
    const { current } = view;
    current?.dispatch(setDiagnostics(current.state, diagnosticsOf(current.state, faults)));
  }, [faults]);
  const [first, last] = marked ?? [-1, -1];
  useEffect(() => {
    const { current } = view;
    if (current === null) return;
    const effects: StateEffect<unknown>[] = [setMark.of(first < 0 ? null : [first, last])];
    if (first >= 0 && first < current.state.doc.lines && !current.hasFocus) {
      const at = current.state.doc.line(first + 1).from;
      effects.push(EditorView.scrollIntoView(at, { y: "start", yMargin: 8 }));
    }
    current.dispatch({ effects });
  }, [first, last]);
  return <div ref={frame} className={style.editor} />;
}
