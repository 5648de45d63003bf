/** The inputs or outputs of an action, and a way to add one. */
import { Button, Group, Select, TextInput } from "@mantine/core";
import { IconPlus } from "@tabler/icons-react";
import { useState } from "react";
import { addParameter } from "../../graph/edit";
import type { Side } from "../../graph/layout";
import type { Action } from "../../graph/model";
import { useBench } from "../bench";
import style from "./details.module.css";
import { ParameterField } from "./parameter-field";
import { fresh, TYPES } from "./pvf";

/** `pose.position.x` as a path. */
export function pathFrom(words: string): string {
  return words
    .trim()
    .split(".")
    .filter((part) => part !== "")
    .map((part) => part.replaceAll("~", "~0").replaceAll("/", "~1"))
    .join("/");
}

function AddParameter({
  action,
  side,
  onDone,
}: {
  action: Action;
  side: Side;
  onDone: () => void;
}) {
  const { doc } = useBench();
  const [name, setName] = useState("");
  const [type, setType] = useState<string>("string");
  const path = pathFrom(name);
  const taken = (side === "in" ? action.inputs : action.outputs).some(
    (other) =>
      other.path === path || other.path.startsWith(`${path}/`) || path.startsWith(`${other.path}/`),
  );
  const submit = () => {
    if (path === "" || taken) return;
    addParameter(doc, action.key, side, path, fresh(type));
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
          error={taken ? "There is one of this name." : undefined}
          onChange={(event) => setName(event.currentTarget.value)}
          flex={1}
        />
        <Select
          aria-label="Type of the parameter"
          data={[...TYPES]}
          value={type}
          onChange={(next) => setType(next ?? "string")}
          w={104}
        />
      </Group>
      <Group gap="xs" mt="xs">
        <Button type="submit" size="compact-sm" disabled={path === "" || taken}>
          Add
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={onDone}>
          Cancel
        </Button>
      </Group>
    </form>
  );
}

export function Parameters({ action, side }: { action: Action; side: Side }) {
  const [adding, setAdding] = useState(false);
  const list = side === "in" ? action.inputs : action.outputs;
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
      {list.map((parameter) => (
        <ParameterField key={parameter.path} owner={action.key} side={side} parameter={parameter} />
      ))}
      {list.length === 0 && !adding && (
        <p className={style.hint}>{side === "in" ? "Takes none." : "Gives none."}</p>
      )}
      {adding && <AddParameter action={action} side={side} onDone={() => setAdding(false)} />}
    </section>
  );
}
