/** The fields that open under a row of the outline: a new name, another target, another response, an arrow. */

import { Select, Textarea, TextInput } from "@mantine/core";
import { useState } from "react";
import { OUTCOMES, outcomeWord } from "../canvas/outcome";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import { asOneEdit, connect, rename, retarget, setEntry, setResponse } from "../graph/edit";
import { changeNote } from "../graph/edit/notes";
import { ENTRY, EXIT, type Precondition, RESPONSES, type Response } from "../graph/model";
import { endName } from "../graph/relation-words";
import { useDraft } from "../ui/drafts";
import { keyOf } from "../ui/keys";
import { isolated } from "../words/isolated";
import { outcomesOf, type RowEditKind } from "./row-actions";
import type { OutlineItem } from "./rows";

interface Props {
  row: OutlineItem;
  change: RowEditKind;
  /** With the id of what is selected next, if that is something new. */
  onDone: (said: string | null) => void;
}

function ends(context: EditorContext, exit: boolean) {
  return [
    ...(exit ? [{ value: EXIT, label: "Exit: the graph ends" }] : []),
    ...context.graph.actions.map(({ key }) => ({ value: key, label: endName(context.graph, key) })),
  ];
}

function Rename({ row, onDone }: Props) {
  const { doc } = useEditorContext();
  const old = row.kind === "action" ? row.action.name : "";
  const key = row.kind === "action" ? row.action.key : "";
  const field = useDraft({
    of: key,
    value: old,
    check: (draft) => (draft.trim() === "" ? "Enter a name for the action." : null),
    onCommit: (draft) => rename(doc, key, draft.trim()),
    onLeaving: true,
  });
  const next = field.text.trim();
  const end = (write: boolean) => {
    const isNew = write && field.wrong === null && next !== old;
    if (isNew) field.leave();
    else field.discard();
    onDone(isNew ? `${old} is called ${next}` : null);
  };
  return (
    <TextInput
      aria-label={`New name of ${old}`}
      autoFocus
      value={field.text}
      error={field.wrong ?? undefined}
      onFocus={(event) => event.currentTarget.select()}
      onChange={(event) => field.change(event.currentTarget.value)}
      onKeyDown={(event) => {
        const key = keyOf(event);
        if (key === "Enter" || key === "Escape") end(key === "Enter");
      }}
      onBlur={() => end(true)}
    />
  );
}

function Connect({ row, onDone }: Props) {
  const context = useEditorContext();
  const fixed = row.kind === "outcome" ? row.outcome : null;
  const [outcome, setOutcome] = useState<Precondition>(fixed ?? "on_true");
  const entry = row.kind === "entry";
  const from = entry ? ENTRY : "action" in row ? row.action.key : null;
  const to = (target: string | null) => {
    if (target === null || from === null) return onDone(null);
    if (entry) setEntry(context.doc, target);
    else connect(context.doc, from, target, outcome);
    const when = entry ? "" : ` when ${outcomeWord[outcome]}`;
    onDone(
      `Connected ${isolated(endName(context.graph, from))} to ${isolated(endName(context.graph, target))}${when}`,
    );
  };
  return (
    <div className="flex gap-37_5">
      {!entry && (
        <Select
          aria-label="When it is"
          data={OUTCOMES.map((value) => ({ value, label: outcomeWord[value] }))}
          value={outcome}
          onChange={(next) => setOutcome((next ?? "on_true") as Precondition)}
          w={116}
        />
      )}
      <Select
        aria-label="Run"
        placeholder="run …"
        searchable
        autoFocus
        data={ends(context, !entry)}
        value={null}
        onChange={to}
        onKeyDown={(event) => {
          if (keyOf(event) === "Escape") onDone(null);
        }}
        flex={1}
      />
    </div>
  );
}

function Pick({ row, change, onDone }: Props) {
  const context = useEditorContext();
  if (row.kind !== "target") return null;
  const id = relationId(row.relation);
  const name = endName(context.graph, row.relation.child);
  const response = change === "response";
  const pick = (next: string | null) => {
    if (next === null) return onDone(null);
    const own = outcomesOf(row);
    if (response) {
      asOneEdit(context.doc, () => {
        for (const outcome of own) setResponse(context.doc, id, outcome, next as Response);
      });
      const when = own.map((outcome) => outcomeWord[outcome]).join(" or ");
      return onDone(`When ${when}: ${next} ${isolated(name)}`);
    }
    const moved = asOneEdit(context.doc, () =>
      own.map((outcome) => retarget(context.doc, id, outcome, { child: next })),
    );
    if (moved.includes(null)) return onDone("It cannot lead there");
    onDone(`The arrow leads to ${isolated(endName(context.graph, next))}`);
  };
  return (
    <Select
      aria-label={response ? `What ${isolated(name)} does` : "Leads to"}
      searchable={!response}
      autoFocus
      defaultDropdownOpened
      data={response ? [...RESPONSES] : ends(context, row.relation.parent !== ENTRY)}
      value={response ? row.response : row.relation.child}
      onChange={pick}
      onKeyDown={(event) => {
        if (keyOf(event) === "Escape") onDone(null);
      }}
    />
  );
}

function Write({ row, onDone }: Props) {
  const { doc } = useEditorContext();
  const old = row.kind === "note" ? row.note.text : "";
  const note = row.kind === "note" ? row.note.key : "";
  const field = useDraft({
    of: note,
    value: old,
    onCommit: (text) => changeNote(doc, note, { text }),
    onLeaving: true,
  });
  const end = (write: boolean) => {
    const isNew = write && field.text !== old;
    if (isNew) field.leave();
    else field.discard();
    onDone(isNew ? "The text is written" : null);
  };
  return (
    <Textarea
      aria-label="Text of the note"
      autoFocus
      autosize
      maxRows={8}
      maxLength={5_000}
      value={field.text}
      onChange={(event) => field.change(event.currentTarget.value)}
      onKeyDown={(event) => {
        const key = keyOf(event);
        if (key === "Enter" && !event.shiftKey) {
          event.preventDefault();
          end(true);
        }
        if (key === "Escape") end(false);
      }}
      onBlur={() => end(true)}
    />
  );
}

export function RowEdit(props: Props) {
  if (props.row.kind === "note") return <Write {...props} />;
  switch (props.change) {
    case "rename":
      return <Rename {...props} />;
    case "connect":
      return <Connect {...props} />;
    case "response":
    case "target":
      return <Pick {...props} />;
  }
}
