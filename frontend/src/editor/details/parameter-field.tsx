/** One parameter as a form field that fits its type. */
import { ActionIcon, SegmentedControl, Select, Tooltip } from "@mantine/core";
import { IconBackspace, IconLock, IconTrash } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { removeParameter, setParameter } from "../../graph/edit";
import type { Side } from "../../graph/layout";
import type { Key, Parameter } from "../../graph/model";
import { pathWords } from "../../ui/canvas/value-text";
import { useBench } from "../bench";
import { DraftInput } from "../draft-input";
import style from "./details.module.css";
import { complaint, type Field, fieldOf, shown, typed, withValue } from "./pvf";

interface Props {
  owner: Key;
  side: Side;
  parameter: Parameter;
}

const hints: Partial<Record<string, string>> = {
  strings: "one text on each line",
  numbers: "one number on each line",
  bools: "true or false on each line",
};

function Label({
  parameter,
  field,
  onRemove,
}: {
  parameter: Parameter;
  field: Field;
  onRemove: () => void;
}) {
  return (
    <span className={style.label}>
      <span className={style.path} title={pathWords(parameter.path)}>
        {pathWords(parameter.path)}
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
      <Tooltip label="Remove this parameter">
        <ActionIcon
          size={18}
          className={style.remove ?? ""}
          aria-label={`Remove the parameter ${pathWords(parameter.path)}`}
          onClick={onRemove}
        >
          <IconTrash size={12} />
        </ActionIcon>
      </Tooltip>
    </span>
  );
}

export function ParameterField({ owner, side, parameter }: Props) {
  const { doc } = useBench();
  const field = fieldOf(parameter.text);
  const write = (text: string) => setParameter(doc, owner, side, parameter.path, text);
  const label: ReactNode = (
    <Label
      parameter={parameter}
      field={field}
      onRemove={() => removeParameter(doc, owner, side, parameter.path)}
    />
  );
  const name = pathWords(parameter.path);
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
        onCommit={write}
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
          onChange={(next) => write(withValue(parameter.text, next === "" ? null : next))}
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
        onChange={(next) => write(withValue(parameter.text, next))}
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
        if ("ok" in result) write(withValue(parameter.text, result.ok));
      }}
      rightSection={
        native === "string" && field.value !== null ? (
          <Tooltip label="No value: let an output fill it">
            <ActionIcon
              size="sm"
              aria-label={`Take the value of ${name} away`}
              onClick={() => write(withValue(parameter.text, null))}
            >
              <IconBackspace size={14} />
            </ActionIcon>
          </Tooltip>
        ) : null
      }
    />
  );
}
