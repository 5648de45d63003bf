/** The actions of a graph put in the place of the action that stands for it: at once where that does the same, else it is asked. */
import { Button, Modal } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useEffect, useState } from "react";
import { lookAtUnpacking, type UnpackingLook } from "../api/documents/inside";
import { errorText } from "../api/http";
import type { EditorContext } from "../edit-actions/editor-context";
import { collisionsOfActions, places } from "../graph/edit/key-changes";
import type { Key } from "../graph/model";
import { announcer } from "../ui/announcer";
import { useStableCallback } from "../ui/hooks/use-stable-callback";
import { isolated } from "../words/isolated";
import style from "./levels.module.css";
import { ReasonList } from "./reason-list";
import { makeActionEdit } from "./subgraph-edits";

interface Props {
  context: EditorContext;
  action: Key;
  onClose: () => void;
}

function failed(message: string): void {
  notifications.show({ color: "red", title: "Not unpacked", message, autoClose: 12_000 });
}

/** Makes the edit, unless others have changed something of the action meanwhile. */
function unpack(context: EditorContext, look: UnpackingLook): void {
  const changes = look.changes ?? [];
  const changed = places(context.graph, collisionsOfActions(context.doc, changes));
  if (changed.length > 0) {
    failed(`Changed meanwhile: ${changed.join(", ")}.`);
    return;
  }
  makeActionEdit(context, changes);
  const count = (look.actions ?? []).length;
  announcer.say(count === 1 ? "Unpacked into 1 action" : `Unpacked into ${count} actions`);
}

function Asked({ look, context, onClose, name }: Asking) {
  const { differences = [], reasons = [], left_out: left = [] } = look;
  const refused = reasons.length > 0;
  const told = refused ? reasons : differences;
  return (
    <>
      {told.length > 0 && (
        <p>
          {refused
            ? "No actions in its place would do the same, so it stays:"
            : "In its place they may do otherwise than inside:"}
        </p>
      )}
      <ReasonList label="What would be otherwise" reasons={told} {...{ context, onClose }} />
      {left.length > 0 && (
        <p className={style.quiet}>
          No action has these any more: {left.map(isolated).join(", ")} of <bdi>{name}</bdi>.
        </p>
      )}
      <div className={style.answers}>
        <Button onClick={onClose}>{refused ? "Close" : "Cancel"}</Button>
        {!refused && (
          <Button
            variant="filled"
            onClick={() => {
              onClose();
              unpack(context, look);
            }}
          >
            {told.length > 0 ? "Unpack it all the same" : "Unpack it"}
          </Button>
        )}
      </div>
    </>
  );
}

interface Asking extends Omit<Props, "action"> {
  look: UnpackingLook;
  name: string;
}

export function UnpackDialog({ context, action, onClose }: Props) {
  const [look, setLook] = useState<UnpackingLook | null>(null);
  const name = context.graph.actions.find(({ key }) => key === action)?.name ?? "";
  const looked = useStableCallback((found: UnpackingLook) => {
    const { differences = [], reasons = [], left_out: left = [] } = found;
    if (differences.length + reasons.length + left.length > 0) {
      setLook(found);
      return;
    }
    onClose();
    unpack(context, found);
  });
  const stopped = useStableCallback((error: unknown) => {
    onClose();
    failed(errorText(error));
  });
  const placeOf = useStableCallback(() => context.positions().get(action));
  useEffect(() => {
    let isOpen = true;
    const at = placeOf();
    const body = { action, ...(at && { at: [...at] as [number, number] }) };
    lookAtUnpacking(context.id, body).then(
      (found) => isOpen && looked(found),
      (error) => isOpen && stopped(error),
    );
    return () => {
      isOpen = false;
    };
  }, [context.id, action, looked, stopped, placeOf]);
  if (look === null) return null;
  return (
    <Modal opened onClose={onClose} title={`Unpack ${isolated(name)}`} size="32rem">
      <Asked {...{ look, context, onClose, name }} />
    </Modal>
  );
}
