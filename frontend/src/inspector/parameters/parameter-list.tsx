/** The inputs or outputs of an action, and a way to add one. */
import { Button, Group, Select, TextInput } from "@mantine/core";
import { IconPlus } from "@tabler/icons-react";
import { useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ParameterSide } from "../../graph/document-keys";
import { addParameter, asOneEdit } from "../../graph/edit";
import type { Action } from "../../graph/model";
import { pathWords } from "../../graph/value-text";
import { SharedField } from "../fields/shared-field";
import style from "../inspector.module.css";
import { ParameterField } from "./parameter-field";
import { type Family, families, pathFrom, taken } from "./parameter-path";
import { fresh, GROUPS, TYPES } from "./parameter-values";

interface AddProps {
  action: Action;
  side: ParameterSide;
  onDone: () => void;
}

function AddParameter({ action, side, onDone }: AddProps) {
  const { doc } = useEditorContext();
  const [name, setName] = useState("");
  const [type, setType] = useState<string>("string");
  const path = pathFrom(name);
  const list = side === "in" ? action.inputs : action.outputs;
  const wrong = path === "" ? null : taken(list, path);
  const submit = () => {
    if (path === "" || wrong !== null) return;
    asOneEdit(doc, () => {
      for (const member of GROUPS[type] ?? [null]) {
        const full = member === null ? path : `${path}/${member}`;
        addParameter(doc, action.key, side, full, fresh(member === null ? type : "number"));
      }
    });
    onDone();
  };
  return (
    <form
      className={style.adding}
      onSubmit={(event) => {
        event.preventDefault();
        submit();
      }}
    >
      <Group gap="xs" wrap="nowrap" align="start">
        <TextInput
          autoFocus
          aria-label="Name of the parameter"
          placeholder="name, or group.name"
          value={name}
          error={wrong ?? undefined}
          onChange={(event) => setName(event.currentTarget.value)}
          flex={1}
        />
        <Select
          aria-label="Type of the parameter"
          data={[
            { group: "One value", items: [...TYPES] },
            { group: "A group of numbers", items: Object.keys(GROUPS) },
          ]}
          value={type}
          onChange={(next) => setType(next ?? "string")}
          w={104}
        />
      </Group>
      <Group gap="xs">
        <Button type="submit" size="compact-sm" disabled={path === "" || wrong !== null}>
          Add
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={onDone}>
          Cancel
        </Button>
      </Group>
    </form>
  );
}

export function ParameterList({ action, side }: { action: Action; side: ParameterSide }) {
  const [adding, setAdding] = useState(false);
  const list = side === "in" ? action.inputs : action.outputs;
  const fields = ({ prefix, members }: Family) =>
    members.map((parameter) => (
      <SharedField key={parameter.path} of={action.key} field={`${side}/${parameter.path}`}>
        <ParameterField
          owner={action.key}
          side={side}
          parameter={parameter}
          name={pathWords(parameter.path.slice(prefix.length))}
          others={list.filter((other) => other !== parameter)}
        />
      </SharedField>
    ));
  return (
    <section className={style.section}>
      <div className={style.heading}>
        <h3>{side === "in" ? "Parameters" : "Outputs"}</h3>
        <Button
          size="compact-xs"
          variant="subtle"
          leftSection={<IconPlus size={12} />}
          onClick={() => setAdding(true)}
        >
          Add
        </Button>
      </div>
      {families(list).map((family) =>
        family.prefix === "" ? (
          fields(family)
        ) : (
          <fieldset key={`${family.prefix} ${family.members[0]?.path}`} className={style.group}>
            <legend>{pathWords(family.prefix.slice(0, -1))}</legend>
            {fields(family)}
          </fieldset>
        ),
      )}
      {list.length === 0 && !adding && (
        <p className={style.hint}>{side === "in" ? "Takes none." : "Gives none."}</p>
      )}
      {adding && <AddParameter action={action} side={side} onDone={() => setAdding(false)} />}
    </section>
  );
}
