/** The name under which a course is expected from now on, and the word that keeps it. */
import { Button, TextInput } from "@mantine/core";
import { useState } from "react";
import { errorText } from "../api/http";
import style from "./courses.module.css";

interface Props {
  proposed: string;
  onKeep: (name: string) => Promise<unknown>;
  onClose: () => void;
}

export function NameField({ proposed, onKeep, onClose }: Props) {
  const [name, setName] = useState(proposed);
  const [busy, setBusy] = useState(false);
  const [refused, setRefused] = useState("");
  const keep = async () => {
    setBusy(true);
    try {
      await onKeep(name);
      onClose();
    } catch (error) {
      setRefused(errorText(error));
    } finally {
      setBusy(false);
    }
  };
  return (
    <form
      className={style.naming}
      onSubmit={(event) => {
        event.preventDefault();
        void keep();
      }}
    >
      <TextInput
        size="xs"
        aria-label="Name of the expected course"
        value={name}
        maxLength={100}
        error={refused || undefined}
        data-autofocus
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Button size="compact-sm" type="submit" loading={busy} disabled={name.trim() === ""}>
        Expect this
      </Button>
      <Button size="compact-sm" variant="subtle" onClick={onClose}>
        Cancel
      </Button>
    </form>
  );
}
