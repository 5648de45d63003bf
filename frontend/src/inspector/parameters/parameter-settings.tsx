/** The settings of a parameter, apart from its value: name, type, allowed values, required, locked. */
import { Button, Group, Switch } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ParameterSide } from "../../graph/document-keys";
import { removeParameter, renameParameter, setParameter } from "../../graph/edit";
import { pathWords } from "../../graph/field-words";
import type { Key, Parameter } from "../../graph/model";
import { pathFrom, taken } from "../../graph/parameters/names";
import {
  allowedLines,
  parameterValueOf,
  TYPES,
  withAllowed,
  withLock,
  withRequired,
  withType,
} from "../../graph/parameters/values";
import { DraftChoice, DraftInput } from "../../ui/draft-input";
import { isolated } from "../../words/isolated";
import style from "../inspector.module.css";

interface Props {
  owner: Key;
  side: ParameterSide;
  parameter: Parameter;
  others: readonly Parameter[];
  onClose: () => void;
}

export function ParameterSettings({ owner, side, parameter, others, onClose }: Props) {
  const { doc } = useEditorContext();
  const field = parameterValueOf(parameter.text);
  const name = pathWords(parameter.path);
  const write = (change: (now: string) => string) =>
    setParameter(doc, owner, side, parameter.path, change);
  return (
    <section className={style.adding} aria-label={`What the parameter ${isolated(name)} is`}>
      <DraftInput
        label="Name"
        value={name}
        onLeaving
        check={(draft) => taken(others, pathFrom(draft))}
        onCommit={(draft) => renameParameter(doc, owner, side, parameter.path, pathFrom(draft))}
      />
      <DraftChoice
        label="Type"
        data={TYPES}
        value={field.type ?? ""}
        onCommit={(type) => type.trim() === "" || write((now) => withType(now, type.trim()))}
      />
      {field.native !== null && (
        <DraftInput
          label="Allowed values, one on each line"
          lines
          value={allowedLines(field)}
          placeholder="anything"
          check={(draft) => {
            const result = withAllowed(parameter.text, draft);
            return "wrong" in result ? result.wrong : null;
          }}
          onCommit={(draft) =>
            write((now) => {
              const result = withAllowed(now, draft);
              return "ok" in result && result.ok !== null ? result.ok : now;
            })
          }
        />
      )}
      <Switch
        label="Required"
        description="The action does not run without a value"
        checked={field.required}
        onChange={(event) => {
          const required = event.currentTarget.checked;
          write((now) => withRequired(now, required));
        }}
      />
      {side === "in" && (
        <Switch
          label="Locked"
          description="Outputs of other actions never replace the value"
          checked={field.locked}
          onChange={(event) => {
            const locked = event.currentTarget.checked;
            write((now) => withLock(now, locked));
          }}
        />
      )}
      <Group gap="xs">
        <Button size="compact-sm" disabled={false} onClick={onClose}>
          Close
        </Button>
        <Button
          size="compact-sm"
          variant="subtle"
          color="red"
          leftSection={<IconTrash size={13} aria-hidden />}
          aria-label={`Remove the parameter ${isolated(name)}`}
          onClick={() => removeParameter(doc, owner, side, parameter.path)}
        >
          Remove
        </Button>
      </Group>
    </section>
  );
}
