/** One parameter as a form field that fits its type. */
import { ActionIcon, SegmentedControl, Select, Tooltip } from "@mantine/core";
import { IconAdjustments, IconBackspace, IconLock } from "@tabler/icons-react";
import { type ReactNode, useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ParameterSide } from "../../graph/document-keys";
import { setParameter } from "../../graph/edit";
import type { Key, Parameter } from "../../graph/model";
import { pathWords } from "../../graph/value-text";
import { DraftInput } from "../../ui/draft-input";
import style from "../inspector.module.css";
import { ParameterSettings } from "./parameter-settings";
import {
  complaint,
  type ParameterValue,
  parameterValueOf,
  shown,
  typed,
  withValue,
} from "./parameter-values";

interface Props {
  owner: Key;
  side: ParameterSide;
  parameter: Parameter;
  /** What it is called within its group. */
  name: string;
  /** The others of its side. */
  others: readonly Parameter[];
}

const hints: Partial<Record<string, string>> = {
  strings: "one text on each line",
  numbers: "one number on each line",
  bools: "true or false on each line",
};

interface LabelProps {
  name: string;
  /** With its groups. */
  fullName: string;
  field: ParameterValue;
  open: boolean;
  onOpen: () => void;
}

function Label({ name, fullName, field, open, onOpen }: LabelProps) {
  return (
    <span className={style.label}>
      <span className={style.path} title={fullName}>
        {name}
      </span>
      <span className={style.type}>
        {field.type ?? "no type"}
        {!field.required && " · optional"}
      </span>
      {field.locked && (
        <Tooltip label="Locked: outputs of other actions never replace this value">
          <IconLock size={12} aria-label="locked" />
        </Tooltip>
      )}
      <Tooltip label="Name, type, allowed values …">
        <ActionIcon
          size={24}
          className={style.remove ?? ""}
          disabled={false}
          aria-label={`What the parameter ${fullName} is`}
          aria-expanded={open}
          onClick={(event) => {
            event.preventDefault();
            onOpen();
          }}
        >
          <IconAdjustments size={14} />
        </ActionIcon>
      </Tooltip>
    </span>
  );
}

export function ParameterField({ owner, side, parameter, name, others }: Props) {
  const { doc } = useEditorContext();
  const [open, setOpen] = useState(false);
  const field = parameterValueOf(parameter.text);
  const label: ReactNode = (
    <Label
      name={name}
      fullName={pathWords(parameter.path)}
      field={field}
      open={open}
      onOpen={() => setOpen(!open)}
    />
  );
  return (
    <div className={style.parameter}>
      <Value
        label={label}
        name={pathWords(parameter.path)}
        field={field}
        parameter={parameter}
        write={(change) => setParameter(doc, owner, side, parameter.path, change)}
      />
      {open && (
        <ParameterSettings
          owner={owner}
          side={side}
          parameter={parameter}
          others={others}
          onClose={() => setOpen(false)}
        />
      )}
    </div>
  );
}

interface ValueProps {
  label: ReactNode;
  name: string;
  field: ParameterValue;
  parameter: Parameter;
  write: (change: (now: string) => string) => void;
}

/** The value, as the form field that fits its type. */
function Value({ label, name, field, parameter, write }: ValueProps) {
  if (field.native === null) {
    return (
      <DraftInput
        label={label}
        mono
        lines
        value={parameter.text}
        check={(draft) => {
          try {
            JSON.parse(draft);
            return null;
          } catch {
            return "This is no JSON.";
          }
        }}
        onCommit={(draft) => write(() => draft)}
      />
    );
  }
  if (field.native === "bool") {
    const value = field.value === "true" || field.value === "false" ? field.value : "";
    return (
      <fieldset className={style.fieldset}>
        <legend>{label}</legend>
        <SegmentedControl
          fullWidth
          size="xs"
          aria-label={name}
          data={[
            { value: "true", label: "true" },
            { value: "false", label: "false" },
            { value: "", label: "not given" },
          ]}
          value={value}
          onChange={(next) => write((now) => withValue(now, next === "" ? null : next))}
        />
      </fieldset>
    );
  }
  if (field.allowed.length > 0 && (field.native === "string" || field.native === "number")) {
    return (
      <Select
        label={label}
        aria-label={name}
        placeholder="Choose a value"
        clearable
        data={field.allowed.map((item) => ({ value: item, label: item }))}
        value={field.value}
        onChange={(next) => write((now) => withValue(now, next))}
      />
    );
  }
  const native = field.native;
  return (
    <DraftInput
      label={label}
      mono={native !== "string" && native !== "strings"}
      lines={native === "strings" || native === "numbers" || native === "bools"}
      value={shown(field)}
      inputMode={native === "number" ? "decimal" : "text"}
      placeholder={hints[native] ?? (field.value === null ? "no value: comes from an output" : "")}
      check={(draft) => complaint(field, draft)}
      onCommit={(draft) => {
        const result = typed(native, draft);
        if ("ok" in result) write((now) => withValue(now, result.ok));
      }}
      rightSection={
        native === "string" && field.value !== null ? (
          <Tooltip label="No value: let an output fill it">
            <ActionIcon
              size="sm"
              aria-label={`Take the value of ${name} away`}
              onClick={() => write((now) => withValue(now, null))}
            >
              <IconBackspace size={14} />
            </ActionIcon>
          </Tooltip>
        ) : null
      }
    />
  );
}
