/** Asks for another name of a graph. */
import { Button, Group, Modal, TextInput } from "@mantine/core";
import { useState } from "react";
import type { GraphSummary } from "../api/graphs";
import { isolated } from "../words/isolated";

interface Props {
  graph: GraphSummary;
  opened: boolean;
  onClose: () => void;
  /** Renames the graph; returns whether that was done. */
  onRename: (name: string) => Promise<boolean>;
}

function Rename({ graph, onClose, onRename }: Omit<Props, "opened">) {
  const [name, setName] = useState(graph.name);
  const fits = name.trim() !== "" && name.trim() !== graph.name;
  const save = async () => {
    if (await onRename(name.trim())) onClose();
  };
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (fits) void save();
      }}
    >
      <TextInput
        label="Name of the graph"
        value={name}
        data-autofocus
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Group justify="flex-end" mt="md">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" disabled={!fits}>
          Rename
        </Button>
      </Group>
    </form>
  );
}

export function RenameDialog({ opened, ...props }: Props) {
  return (
    <Modal
      opened={opened}
      onClose={props.onClose}
      title={`Rename ${isolated(props.graph.name)}`}
      closeButtonProps={{ "aria-label": "Close" }}
      centered
    >
      <Rename {...props} />
    </Modal>
  );
}
