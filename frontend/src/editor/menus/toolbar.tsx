/** Tools on the canvas, and the menu of every edit action. */
import { ActionIcon, Menu, Tooltip } from "@mantine/core";
import { IconDots } from "@tabler/icons-react";
import { Fragment, memo } from "react";
import {
  add,
  EDIT_ACTIONS,
  fit,
  marquee,
  note,
  pan,
  redo,
  removeSelection,
  snap,
  tidy,
  undo,
  zoomIn,
  zoomOut,
} from "../../edit-actions/all";
import {
  type EditAction,
  type EditActionGroup,
  isEnabled,
  labelOf,
} from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcut-keys";
import { useStableCallback } from "../../ui/use-stable-callback";
import style from "./toolbar.module.css";

function Tool({ editAction, pressed }: { editAction: EditAction; pressed?: boolean }) {
  const context = useEditorContext();
  const run = useStableCallback(() => editAction.run(context));
  const parts = {
    label: labelOf(editAction, context),
    disabled: !isEnabled(editAction, context),
    run,
  };
  return (
    <ToolButton
      editAction={editAction}
      {...parts}
      {...(pressed === undefined ? {} : { pressed })}
    />
  );
}

interface ToolButtonProps {
  editAction: EditAction;
  label: string;
  disabled: boolean;
  pressed?: boolean;
  run: () => void;
}

/** Drawn again only when it looks different, which edits seldom make it. */
const ToolButton = memo(function ToolButton(props: ToolButtonProps) {
  const { editAction, label, disabled, pressed, run } = props;
  const Sign = editAction.icon;
  return (
    <Tooltip
      label={
        <>
          {label} <FirstShortcut editAction={editAction} />
        </>
      }
    >
      <ActionIcon
        size={34}
        radius={0}
        aria-label={editAction.label}
        aria-pressed={pressed}
        data-pressed={pressed || undefined}
        className={style.tool ?? ""}
        disabled={disabled}
        onClick={run}
      >
        <Sign size={17} aria-hidden />
      </ActionIcon>
    </Tooltip>
  );
});

const GROUPS: readonly EditActionGroup[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];
/** Walking and nudging would be eight lines that nobody clicks. */
const KEYS_ONLY = /^(nudge|walk)-/;

/** Rendered while the menu is open only: what is enabled depends on everything. */
function ActionItems() {
  const context = useEditorContext();
  return GROUPS.map((group) => (
    <Fragment key={group}>
      <Menu.Label>{group}</Menu.Label>
      {EDIT_ACTIONS.filter(
        (editAction) => editAction.group === group && !KEYS_ONLY.test(editAction.name),
      ).map((editAction) => {
        const Sign = editAction.icon;
        return (
          <Menu.Item
            key={editAction.name}
            leftSection={<Sign size={16} aria-hidden />}
            rightSection={<FirstShortcut editAction={editAction} />}
            disabled={!isEnabled(editAction, context)}
            onClick={() => editAction.run(context)}
          >
            {labelOf(editAction, context)}
          </Menu.Item>
        );
      })}
    </Fragment>
  ));
}

function EditActionMenu() {
  return (
    <Menu position="top-start" width={290}>
      <Menu.Target>
        <ActionIcon
          size={34}
          radius={0}
          aria-label="Everything you can do"
          className={style.tool ?? ""}
        >
          <IconDots size={17} aria-hidden />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown className={style.menu ?? ""}>
        <ActionItems />
      </Menu.Dropdown>
    </Menu>
  );
}

export const Toolbar = memo(function Toolbar({ compact }: { compact: boolean }) {
  const { tool, selection, snap: snapping } = useEditorContext();
  return (
    <div className={style.bar} role="toolbar" aria-label="Canvas tools">
      <Tool editAction={add} />
      <Tool editAction={marquee} pressed={tool === "select"} />
      {!compact && <Tool editAction={pan} pressed={tool === "pan"} />}
      <Tool editAction={undo} />
      <Tool editAction={redo} />
      {(!compact || selection.size > 0) && <Tool editAction={removeSelection} />}
      {!compact && <Tool editAction={note} />}
      {!compact && <Tool editAction={tidy} />}
      {!compact && <Tool editAction={snap} pressed={snapping} />}
      {!compact && <Tool editAction={zoomOut} />}
      {!compact && <Tool editAction={zoomIn} />}
      <Tool editAction={fit} />
      <EditActionMenu />
    </div>
  );
});
