/** The toolbar of the canvas, with the button for the menu of all edit actions. */
import { ActionIcon } from "@mantine/core";
import { IconDots } from "@tabler/icons-react";
import { memo } from "react";
import {
  add,
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
import { type EditAction, isEnabled, labelOf } from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcuts";
import { useStableCallback } from "../../ui/hooks";
import { LateOpening } from "../../ui/late-opening";
import { lazyPart } from "../../ui/lazy-part";
import { Tooltip } from "../../ui/tooltip";
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

/** Memoized: most edits do not change how a tool looks. */
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

const EditActionMenu = lazyPart(() =>
  import("./edit-action-menu").then((part) => part.EditActionMenu),
);

function AllActionsButton() {
  return (
    <LateOpening opens="menu" part={(button) => <EditActionMenu button={button} />}>
      <ActionIcon
        size={34}
        radius={0}
        aria-label="Everything you can do"
        className={style.tool ?? ""}
      >
        <IconDots size={17} aria-hidden />
      </ActionIcon>
    </LateOpening>
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
      <AllActionsButton />
    </div>
  );
});
