/** Notices of the room over the canvas: what happened to edits, each with what one can do. */
import { Button, CloseButton, Modal, Text } from "@mantine/core";
import { IconArchive, IconHistory, IconInfoCircle, IconLock, IconUsers } from "@tabler/icons-react";
import { type ReactNode, useState } from "react";
import type { ConnectionNotice } from "../sync/graph-connection";
import type { OtherPerson } from "../sync/indexed-db";
import { otherPeopleWait } from "../sync/unsaved-reasons";
import {
  useGraphPart,
  useLinkPart,
  useMyName,
  useNotice,
  useOthersWaiting,
} from "../sync/use-room";
import style from "./room-notices.module.css";
import { StrandedEditsDialog, useStrandedEditsDialog } from "./stranded-edits-dialog";
import { saveChanges } from "./stranded-edits-file";

const words: Record<ConnectionNotice, string> = {
  "went-back":
    "A backup was restored: the graph is as the server has it now. Nothing of yours was waiting.",
  differed:
    "This page showed something else than the server has, so it was loaded anew. This was reported; nothing of yours is lost.",
};

interface SayProps {
  icon: ReactNode;
  tone?: "warn";
  children: ReactNode;
  action?: ReactNode;
}

function Say({ icon, tone, children, action }: SayProps) {
  return (
    <div className={style.say} data-tone={tone}>
      <span className={style.icon} aria-hidden>
        {icon}
      </span>
      <span className={style.words}>{children}</span>
      {action}
    </div>
  );
}

/** Nobody can change this graph: why, and what can be done. */
function ReadOnly() {
  const readOnly = useLinkPart((link) => link.readOnly);
  if (readOnly === undefined) return null;
  return (
    <Say icon={<IconLock size={16} />} tone="warn">
      {readOnly} What was before that is shown, and can be downloaded and run. Whoever runs the
      server can look with <code>action-assistant verify</code> and bring a backup back with{" "}
      <code>restore</code>.
    </Say>
  );
}

function Others() {
  const { others, read, forget } = useOthersWaiting();
  const graph = useGraphPart(({ name }) => name);
  const [shown, setShown] = useState(false);
  const [sure, setSure] = useState<string | null>(null);
  const said = otherPeopleWait(others);
  if (said === null) return null;
  const name = (other: OtherPerson) => other.name || "a guest";
  const save = async (other: OtherPerson) => saveChanges(graph, name(other), await read(other.id));
  return (
    <Say
      icon={<IconUsers size={16} />}
      action={
        <Button size="compact-sm" onClick={() => setShown(true)}>
          Look
        </Button>
      }
    >
      {said}
      <Modal
        opened={shown}
        onClose={() => setShown(false)}
        title="Changes of others on this device"
        closeButtonProps={{ "aria-label": "Close" }}
        centered
      >
        <Text>
          They are sent when the person signs in here again, and never under another name.
        </Text>
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
    </Say>
  );
}

export function RoomNotices() {
  const by = useMyName();
  const said = useNotice();
  const choosing = useStrandedEditsDialog();
  return (
    <>
      <div className={style.notices} role="status">
        <ReadOnly />
        {said && (
          <Say
            icon={
              said.notice === "went-back" ? <IconHistory size={16} /> : <IconInfoCircle size={16} />
            }
            action={<CloseButton aria-label="Close the note" onClick={said.dismiss} />}
          >
            {words[said.notice]}
          </Say>
        )}
        {choosing.waits && (
          <Say
            icon={<IconArchive size={16} />}
            tone="warn"
            action={
              <Button size="compact-sm" onClick={choosing.takeUp}>
                Decide
              </Button>
            }
          >
            {choosing.edits === 1 ? "1 edit waits" : `${choosing.edits} edits wait`} for your
            decision, since a backup was restored.
          </Say>
        )}
        <Others />
      </div>
      <StrandedEditsDialog by={by} open={choosing.open} onLater={choosing.putOff} />
    </>
  );
}
