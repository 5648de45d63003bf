/** The form for the values of a start: a field for each input that it asks for. */
import { Button, NativeSelect, Textarea, TextInput } from "@mantine/core";
import { useState } from "react";
import type { AskedInput } from "../api/starts";
import { shortText } from "../graph/field-words";
import { spokenName } from "../graph/spoken-name";
import { isolated } from "../words/isolated";
import { type Drafts, draftOf, type Proposal } from "./start-values";
import style from "./start-values-form.module.css";
import { inputWords, placeOfInput } from "./value-words";

interface Props {
  asked: readonly AskedInput[];
  drafts: Drafts;
  /** By place: what is wrong there. */
  wrong: ReadonlyMap<string, string>;
  onChange: (place: string, draft: string) => void;
  /** Values to choose from. */
  proposals?: (asked: AskedInput) => readonly Proposal[];
  readOnly?: boolean;
}

export function StartValuesForm(props: Props) {
  const { asked, drafts, wrong, onChange, proposals, readOnly = false } = props;
  const actions = [...new Set(asked.map(({ action }) => action))];
  return actions.map((action) => (
    <fieldset key={action} className={style.action}>
      <legend>
        <bdi>{spokenName(action)}</bdi>
      </legend>
      {asked
        .filter((each) => each.action === action)
        .map((each) => {
          const place = placeOfInput(each);
          return (
            <Field
              key={place}
              asked={each}
              draft={drafts[place] ?? ""}
              wrong={wrong.get(place) ?? null}
              proposals={proposals?.(each) ?? []}
              readOnly={readOnly}
              onChange={(draft) => onChange(place, draft)}
            />
          );
        })}
    </fieldset>
  ));
}

interface FieldProps {
  asked: AskedInput;
  draft: string;
  wrong: string | null;
  proposals: readonly Proposal[];
  readOnly: boolean;
  onChange: (draft: string) => void;
}

/** Return what is known of the values that an input can have. */
function about({ description = "", least, most, type }: AskedInput): string {
  const bounds =
    least !== undefined && most !== undefined
      ? `${least} to ${most}.`
      : least !== undefined
        ? `${least} at least.`
        : most !== undefined
          ? `${most} at most.`
          : "";
  const lines = type.endsWith("s") ? "One value on each line." : "";
  return [isolated(description), bounds, lines].filter((each) => each !== "").join(" ");
}

function Field({ asked, draft, wrong, proposals, readOnly, onChange }: FieldProps) {
  const [left, setLeft] = useState(false);
  const { name, action, type, unit = "", open } = asked;
  const spoken = `${isolated(inputWords(name))} of ${isolated(spokenName(action))}`;
  const description = about(asked);
  const shared = {
    label: (
      <>
        <bdi>{inputWords(name)}</bdi> <small>{unit === "" ? type : isolated(unit)}</small>
      </>
    ),
    "aria-label": spoken,
    value: draft,
    required: open,
    withAsterisk: false,
    error: wrong !== null && (draft !== "" || left) ? wrong : null,
    ...(description !== "" && { description }),
    onBlur: () => setLeft(true),
  };
  const others = proposals.filter(
    ({ value }, i) =>
      draftOf(asked, value) !== draft &&
      proposals.findIndex((each) => JSON.stringify(each.value) === JSON.stringify(value)) === i,
  );
  return (
    <div className={style.field}>
      <Input {...shared} asked={asked} readOnly={readOnly} onChange={onChange} />
      {!readOnly && others.length > 0 && (
        <span className="wrap gap-25">
          {others.map(({ of, value }) => (
            <Button
              key={of}
              size="compact-xs"
              variant="default"
              aria-label={`Take ${isolated(JSON.stringify(value))} for ${spoken}: ${of}`}
              onClick={() => onChange(draftOf(asked, value))}
            >
              {of}:&nbsp;<bdi>{shortText(JSON.stringify(value), 24)}</bdi>
            </Button>
          ))}
        </span>
      )}
    </div>
  );
}

interface InputProps {
  asked: AskedInput;
  label: React.ReactNode;
  "aria-label": string;
  value: string;
  error: string | null;
  required: boolean;
  withAsterisk: boolean;
  readOnly: boolean;
  onBlur: () => void;
  onChange: (draft: string) => void;
}

function Input({ asked, onChange, readOnly, ...shared }: InputProps) {
  const { type, allowed = [], open } = asked;
  const choices = type === "bool" ? [true, false] : type.endsWith("s") ? [] : allowed;
  const changed = (event: { currentTarget: { value: string } }) =>
    onChange(event.currentTarget.value);
  if (choices.length > 0) {
    const drafts = choices.map((each) => draftOf(asked, each));
    const strange = shared.value === "" || drafts.includes(shared.value) ? [] : [shared.value];
    const none = { value: "", label: open ? "Choose …" : "no value" };
    const data = [
      none,
      ...[...drafts, ...strange].map((value) => ({ value, label: isolated(value) })),
    ];
    return <NativeSelect {...shared} disabled={readOnly} data={data} onChange={changed} />;
  }
  // A field of one line would show a text of several as one.
  if (type.endsWith("s") || shared.value.includes("\n")) {
    return <Textarea {...shared} autosize minRows={2} readOnly={readOnly} onChange={changed} />;
  }
  return (
    <TextInput
      {...shared}
      autoComplete="off"
      spellCheck={false}
      readOnly={readOnly}
      inputMode={type === "number" ? "decimal" : "text"}
      onChange={changed}
    />
  );
}
