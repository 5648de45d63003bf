/** Asks for the name of a new action. */
import { Button, Group, Modal, TextInput } from "@mantine/core";
import { useState } from "react";

interface Props {
  /** What it is called unless somebody says otherwise; null: nobody asks. */
  name: string | null;
  busy: boolean;
  /** Why there is none; empty: nothing stands against it. */
  wrong: string;
  onClose: () => void;
  onMake: (name: string) => void;
}

function Ask({ name: first, busy, wrong, onClose, onMake }: Props) {
  const [name, setName] = useState(first ?? "");
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (name.trim() !== "") onMake(name.trim());
      }}
    >
      <TextInput
        label="Name"
        description="As a C++ class: CloseValve, LocateObject"
        placeholder="CloseValve"
        value={name}
        error={wrong || undefined}
        data-autofocus
        maxLength={200}
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Group justify="flex-end" mt="md">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" loading={busy} disabled={name.trim() === ""}>
          Make it
        </Button>
      </Group>
    </form>
  );
}

export function NewActionDialog(props: Props) {
  return (
    <Modal opened={props.name !== null} onClose={props.onClose} title="New action">
      <Ask {...props} />
    </Modal>
  );
}
