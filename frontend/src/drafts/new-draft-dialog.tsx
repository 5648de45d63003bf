/** Asks for the name of a new draft, and opens it. */
import { Button, Modal, TextInput } from "@mantine/core";
import { useState } from "react";
import { useLocation } from "wouter";
import { makeDraft } from "../api/documents/drafts";
import style from "./drafts.module.css";
import { useDraftStep } from "./use-draft-step";

interface Props {
  graph: string;
  /** The change of which it begins; null: as the graph is now. */
  seq: number | null;
  onClose: () => void;
}

export function NewDraftDialog({ graph, seq, onClose }: Props) {
  const [, go] = useLocation();
  const [name, setName] = useState("");
  const { busy, wrong, step } = useDraftStep();
  const make = () =>
    step(async () => {
      const made = await makeDraft(graph, { name, seq });
      onClose();
      go(`/graphs/${made.id}`);
    });
  return (
    <Modal opened onClose={onClose} title="New draft">
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void make();
        }}
      >
        <TextInput
          label="What will it be about?"
          description={
            seq === null
              ? "A draft begins as the graph is now. What you do there changes nothing here until it is merged."
              : "A draft begins as the graph was at the moment on screen, and changes nothing here until it is merged."
          }
          placeholder="gentler grip"
          maxLength={200}
          data-autofocus
          value={name}
          error={wrong || undefined}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <div className={style.answers}>
          <Button onClick={onClose}>Cancel</Button>
          <Button type="submit" variant="filled" loading={busy}>
            Make it
          </Button>
        </div>
      </form>
    </Modal>
  );
}
