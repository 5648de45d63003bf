/**
 * The head of an open action of the library: its name, and the buttons to edit, undo, export and
 * delete it.
 */
import { ActionIcon, Button, Menu } from "@mantine/core";
import { IconCheck, IconDots, IconDownload, IconPencil, IconTrash } from "@tabler/icons-react";
import { actionDownload } from "../api/library";
import { redo, undo } from "../edit-actions/all";
import type { EditAction } from "../edit-actions/edit-action";
import { isEnabled, labelOf } from "../edit-actions/edit-action";
import { useEditorContext } from "../edit-actions/editor-context";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import style from "./open-action.module.css";

function Tool({ editAction }: { editAction: EditAction }) {
  const context = useEditorContext();
  const Sign = editAction.icon;
  const label = labelOf(editAction, context);
  return (
    <Tooltip label={label}>
      <ActionIcon
        size={34}
        className={style.tool ?? ""}
        aria-label={label}
        disabled={!isEnabled(editAction, context)}
        onClick={() => editAction.run(context)}
      >
        <Sign size={17} aria-hidden />
      </ActionIcon>
    </Tooltip>
  );
}

interface Props {
  name: string;
  editing: boolean;
  onEdit: (editing: boolean) => void;
  onDelete: () => void;
}

function More({ name, onDelete }: Pick<Props, "name" | "onDelete">) {
  const { id, mayEdit } = useEditorContext();
  return (
    <Menu>
      <Menu.Target>
        <ActionIcon
          size={34}
          className={style.tool ?? ""}
          aria-label={`More about ${isolated(name)}`}
        >
          <IconDots size={17} aria-hidden />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Item
          component="a"
          href={actionDownload(id)}
          download={`${name || "action"}.umrf.json`}
          leftSection={<IconDownload size={15} aria-hidden />}
        >
          Export as UMRF
        </Menu.Item>
        <Menu.Item
          c="var(--error)"
          disabled={!mayEdit}
          leftSection={<IconTrash size={15} aria-hidden />}
          onClick={onDelete}
        >
          Delete from the library
        </Menu.Item>
      </Menu.Dropdown>
    </Menu>
  );
}

export function ActionHead({ name, editing, onEdit, onDelete }: Props) {
  const { mayEdit } = useEditorContext();
  return (
    <div className={style.head}>
      <h2 className={style.title}>
        <bdi>{name || "Without a name"}</bdi>
      </h2>
      <div className={style.tools}>
        {editing && (
          <>
            <Tool editAction={undo} />
            <Tool editAction={redo} />
          </>
        )}
        {mayEdit && (
          <Button
            className={style.tool ?? ""}
            leftSection={
              editing ? <IconCheck size={16} aria-hidden /> : <IconPencil size={16} aria-hidden />
            }
            onClick={() => onEdit(!editing)}
          >
            {editing ? "Done" : "Edit"}
          </Button>
        )}
        <More name={name} onDelete={onDelete} />
      </div>
    </div>
  );
}
