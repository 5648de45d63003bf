/** The value of a parameter, as the form field that fits its type. */
import { ActionIcon, Select } from "@mantine/core";
import { IconBackspace } from "@tabler/icons-react";
import type { ReactNode } from "react";
import type { Parameter } from "../../graph/model";
import {
  complaint,
  type ParameterValue,
  shown,
  typed,
  withValue,
} from "../../graph/parameters/values";
import { DraftInput } from "../../ui/draft-input";
import { Segments } from "../../ui/segments";
import { Tooltip } from "../../ui/tooltip";
import { isolated } from "../../words/isolated";
import { useInLibrary } from "../fields/view-only";
import style from "../inspector.module.css";

const HINTS: Partial<Record<string, string>> = {
  strings: "one text on each line",
  numbers: "one number on each line",
  bools: "true or false on each line",
};

interface ValueProps {
  label: ReactNode;
  name: string;
  field: ParameterValue;
  parameter: Parameter;
  /** In the field, at its end. */
  end?: ReactNode;
  write: (change: (now: string) => string) => boolean;
}

function isJson(draft: string): string | null {
  try {
    JSON.parse(draft);
    return null;
  } catch {
    return "This is no JSON.";
  }
}

function BoolValue({ label, name, field, end, write }: ValueProps) {
  const value = field.value === "true" || field.value === "false" ? field.value : "";
  return (
    <fieldset className={style.fieldset}>
      <legend>{label}</legend>
      <div className={style.boolRow}>
        <Segments
          fullWidth
          size="xs"
          label={name}
          data={[
            { value: "true", label: "true" },
            { value: "false", label: "false" },
            { value: "", label: "not given" },
          ]}
          value={value}
          onChange={(next) => write((now) => withValue(now, next === "" ? null : next))}
        />
        {end}
      </div>
    </fieldset>
  );
}

/** Takes the value away: a text that is empty is a value, too. */
function TakeAway({ name, write }: Pick<ValueProps, "name" | "write">) {
  return (
    <Tooltip label="No value: let an output fill it">
      <ActionIcon
        size={26}
        aria-label={`Take the value of ${isolated(name)} away`}
        onClick={() => write((now) => withValue(now, null))}
      >
        <IconBackspace size={14} aria-hidden />
      </ActionIcon>
    </Tooltip>
  );
}

function TypedValue(props: ValueProps & { native: NonNullable<ParameterValue["native"]> }) {
  const { label, name, field, end, write, native } = props;
  const inLibrary = useInLibrary();
  const clearable = native === "string" && field.value !== null;
  const empty = field.required && !field.locked && !inLibrary ? "fill in" : "no value";
  return (
    <DraftInput
      label={label}
      {...(label ? {} : { ariaLabel: name })}
      mono={native !== "string" && native !== "strings"}
      lines={native === "strings" || native === "numbers" || native === "bools"}
      value={shown(field)}
      inputMode={native === "number" ? "decimal" : "text"}
      placeholder={HINTS[native] ?? (field.value === null ? empty : "")}
      check={(draft) => complaint(field, draft)}
      onCommit={(draft) => {
        const result = typed(native, draft);
        return "ok" in result && write((now) => withValue(now, result.ok));
      }}
      rightSectionWidth={clearable && end ? 60 : 32}
      rightSection={
        clearable || end ? (
          <span className="inline-row gap-2px">
            {clearable && <TakeAway name={name} write={write} />}
            {end}
          </span>
        ) : null
      }
    />
  );
}

/** A choice among the allowed values; the present value is shown, too, where it is another one. */
function AllowedValue({ label, name, field, end, write }: ValueProps) {
  const { allowed, value } = field;
  const inLibrary = useInLibrary();
  const strange = value === null || allowed.includes(value) ? [] : [value];
  return (
    <div className={style.allowed}>
      <Select
        label={label}
        aria-label={name}
        placeholder={field.required && !field.locked && !inLibrary ? "fill in" : "no value"}
        clearable
        flex={1}
        data={[
          ...allowed.map((item) => ({ value: item, label: item })),
          ...strange.map((item) => ({ value: item, label: `${item} · not allowed` })),
        ]}
        value={value}
        onChange={(next) => write((now) => withValue(now, next))}
      />
      {end}
    </div>
  );
}

export function ParameterInput(props: ValueProps) {
  const { label, field, parameter, write } = props;
  const { native } = field;
  if (native === null) {
    return (
      <DraftInput
        label={label}
        mono
        lines
        value={parameter.text}
        check={isJson}
        onCommit={(draft) => write(() => draft)}
      />
    );
  }
  if (native === "bool") return <BoolValue {...props} />;
  if (field.allowed.length > 0 && (native === "string" || native === "number")) {
    return <AllowedValue {...props} />;
  }
  return <TypedValue {...props} native={native} />;
}
