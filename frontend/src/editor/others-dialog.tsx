/** Edits of others that wait on this device: to be saved for them, or dropped. Never sent. */
import { Button, Modal, Text } from "@mantine/core";
import { useState } from "react";
import type { OtherPerson } from "../sync/indexed-db";
import type { OthersWaiting } from "../sync/use-room";
import style from "./room-notices.module.css";
import { saveChanges } from "./stranded-edits-file";

interface Props {
  graph: string;
  waiting: OthersWaiting;
  opened: boolean;
  onClose: () => void;
}

export function OthersDialog({ graph, waiting, opened, onClose }: Props) {
  const { others, read, forget } = waiting;
  const [sure, setSure] = useState<string | null>(null);
  const name = (other: OtherPerson) => other.name || "a guest";
  const save = async (other: OtherPerson) => saveChanges(graph, name(other), await read(other.id));
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title="Changes of others on this device"
      closeButtonProps={{ "aria-label": "Close" }}
      centered
    >
      <Text>They are sent when the person signs in here again, and never under another name.</Text>
      <ul className={style.others}>
        {others.map((other) => (
          <li key={other.id}>
            <b>{name(other)}</b>
            <span>{other.waiting === 1 ? "1 change" : `${other.waiting} changes`}</span>
            <Button size="compact-sm" onClick={() => save(other)}>
              Save as a file
            </Button>
            {sure === other.id ? (
              <Button size="compact-sm" color="red" onClick={() => forget(other.id)}>
                Discard for good
              </Button>
            ) : (
              <Button size="compact-sm" onClick={() => setSure(other.id)}>
                Discard
              </Button>
            )}
          </li>
        ))}
      </ul>
    </Modal>
  );
}
