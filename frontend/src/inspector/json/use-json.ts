/** The JSON of a graph while it is read and while it is edited: newest text, draft, verdict. */
import { useQuery } from "@tanstack/react-query";
import { useEffect, useMemo, useRef, useState } from "react";
import { graphMoment, type TextChanges, textChangesOf } from "../../api/graphs";
import { errorText, Refusal } from "../../api/http";
import { usePerson } from "../../api/people";
import { textScope, useKeptText } from "../../ui/kept-texts";
import type { JsonError } from "./json-editor";
import { lineOf } from "./json-positions";

const PAUSE = 400; // ms

interface JsonSnapshot {
  readonly text: string;
  readonly seq: number;
}

/** A text being edited, and the moment whose text it was. */
interface Draft {
  readonly text: string;
  readonly base: JsonSnapshot;
}

export type Verdict =
  | { readonly kind: "checking" }
  | { readonly kind: "fits"; readonly rewriting: TextChanges }
  | { readonly kind: "wrong"; readonly fault: JsonError }
  | { readonly kind: "unknown"; readonly why: string };

const CHECKING: Verdict = { kind: "checking" };

function readDraft(kept: string): Draft | null {
  return kept === "" ? null : (JSON.parse(kept) as Draft);
}

/** Drafts outlive the panel: whoever looks at something else in between finds the text again. */
function useJsonDraft(graph: string) {
  const { person } = usePerson();
  const [kept, keep] = useKeptText(`${textScope(graph, person.id)}json`);
  const draft = useMemo(() => readDraft(kept), [kept]);
  const keepDraft = (next: Draft | null) => keep(next === null ? "" : JSON.stringify(next));
  return [draft, keepDraft] as const;
}

function verdictOf(error: unknown, text: string): Verdict {
  if (!(error instanceof Refusal)) return { kind: "unknown", why: errorText(error) };
  const { where, detail, title } = error.details;
  const line = where?.line !== undefined ? where.line - 1 : lineOf(text, where?.path ?? "");
  const column = where?.column === undefined ? null : where.column - 1;
  return { kind: "wrong", fault: { line, column, message: detail || title, severity: "error" } };
}

export function useJson(graph: string, seq: number) {
  const query = useQuery({
    queryKey: ["graphs", graph, "json", seq],
    queryFn: () => graphMoment(graph),
    placeholderData: (before) => before,
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 30_000,
  });
  const newest = query.data;
  const [draft, keepDraft] = useJsonDraft(graph);
  const [verdict, setVerdict] = useState<Verdict>(CHECKING);
  // The applied text is shown until the server's text has it, too.
  const [applied, setApplied] = useState<JsonSnapshot | null>(null);
  const arrived = newest !== undefined && applied !== null && newest.seq > applied.seq;
  useEffect(() => {
    if (arrived) setApplied(null);
  }, [arrived]);
  const asked = useRef(0);
  const text = draft?.text;
  const base = draft?.base.seq;
  useEffect(() => {
    if (text === undefined || base === undefined) return;
    setVerdict(CHECKING);
    asked.current += 1;
    const mine = asked.current;
    const timer = setTimeout(async () => {
      const answer = await textChangesOf(graph, base, text).then(
        (rewriting): Verdict => ({ kind: "fits", rewriting }),
        (error: unknown) => verdictOf(error, text),
      );
      if (asked.current === mine) setVerdict(answer);
    }, PAUSE);
    return () => clearTimeout(timer);
  }, [graph, text, base]);
  return {
    error: query.error,
    newest,
    draft,
    verdict,
    text: draft?.text ?? (arrived ? undefined : applied?.text) ?? newest?.text,
    edit(next: string) {
      const from = draft?.base ?? newest;
      if (from === undefined) return;
      keepDraft(next === from.text ? null : { text: next, base: from });
    },
    discard: () => keepDraft(null),
    done() {
      if (draft) setApplied({ text: draft.text, seq: newest?.seq ?? draft.base.seq });
      keepDraft(null);
    },
  };
}
