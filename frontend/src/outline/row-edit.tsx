/** What opens under a row of the outline: a new name, another target, another response, an arrow. */
import { Select, Textarea, TextInput } from "@mantine/core";
import { useState } from "react";
import { OUTCOMES, outcomeWord } from "../canvas/outcome";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import { asOneEdit, connect, rename, retarget, setEntry, setResponse } from "../graph/edit";
import { changeNote } from "../graph/edit/notes";
import { ENTRY, EXIT, type Precondition, RESPONSES, type Response } from "../graph/model";
import { endName } from "../graph/relation-words";
import { keyOf } from "../ui/keys";
import style from "./outline.module.css";
import { outcomesOf } from "./row-actions";
import type { OutlineItem } from "./rows";

export type RowEditKind = "rename" | "connect" | "response" | "target";

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
  const [name, setName] = useState(old);
  const save = () => {
    const next = name.trim();
    if (row.kind !== "action" || next === "" || next === old) return onDone(null);
    rename(doc, row.action.key, next);
    onDone(`${old} is called ${next}`);
  };
  return (
    <TextInput
      aria-label={`New name of ${old}`}
      autoFocus
      value={name}
      error={name.trim() === "" ? "An action has a name." : undefined}
      onFocus={(event) => event.currentTarget.select()}
      onChange={(event) => setName(event.currentTarget.value)}
      onKeyDown={(event) => {
        const key = keyOf(event);
        if (key === "Enter") save();
        if (key === "Escape") onDone(null);
      }}
      onBlur={save}
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
    onDone(`Connected ${endName(context.graph, from)} to ${endName(context.graph, target)}${when}`);
  };
  return (
    <div className={style.pair}>
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
      return onDone(`When ${when}: ${next} ${name}`);
    }
    const moved = asOneEdit(context.doc, () =>
      own.map((outcome) => retarget(context.doc, id, outcome, { child: next })),
    );
    if (moved.includes(null)) return onDone("It cannot lead there");
    onDone(`The arrow leads to ${endName(context.graph, next)}`);
  };
  return (
    <Select
      aria-label={response ? `What ${name} does` : "Leads to"}
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
  const [text, setText] = useState(old);
  const save = () => {
    if (row.kind !== "note" || text === old) return onDone(null);
    changeNote(doc, row.note.key, { text });
    onDone("The text is written");
  };
  return (
    <Textarea
      aria-label="Text of the note"
      autoFocus
      autosize
      maxRows={8}
      maxLength={5_000}
      value={text}
      onChange={(event) => setText(event.currentTarget.value)}
      onKeyDown={(event) => {
        const key = keyOf(event);
        if (key === "Enter" && !event.shiftKey) {
          event.preventDefault();
          save();
        }
        if (key === "Escape") onDone(null);
      }}
      onBlur={save}
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
