/** The toolbar of the canvas, with the button for the menu of all edit actions, and the zoom beside it. */
import { ActionIcon } from "@mantine/core";
import { IconDots } from "@tabler/icons-react";
import { useStore } from "@xyflow/react";
import { memo } from "react";
import {
  add,
  fit,
  marquee,
  note,
  redo,
  removeSelection,
  tidy,
  undo,
  zoomIn,
  zoomOut,
} from "../../edit-actions/all";
import { type EditAction, isEnabled, labelOf } from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcuts";
import { useHasFingersOnly, useStableCallback } from "../../ui/hooks";
import { LateOpening } from "../../ui/late-opening";
import { lazyPart } from "../../ui/lazy-part";
import { Tooltip } from "../../ui/tooltip";
import style from "./toolbar.module.css";

interface ToolProps {
  editAction: EditAction;
  pressed?: boolean;
  /** The word beside the sign; without it the sign stands alone. */
  word?: string | false;
}

function Tool({ editAction, ...look }: ToolProps) {
  const context = useEditorContext();
  const run = useStableCallback(() => editAction.run(context));
  const parts = {
    label: labelOf(editAction, context),
    disabled: !isEnabled(editAction, context),
    run,
  };
  return <ToolButton editAction={editAction} {...parts} {...look} />;
}

interface ToolButtonProps extends ToolProps {
  label: string;
  disabled: boolean;
  run: () => void;
}

/** Memoized: most edits do not change how a tool looks. */
const ToolButton = memo(function ToolButton(props: ToolButtonProps) {
  const { editAction, label, disabled, pressed, word, run } = props;
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
        data-word={word || undefined}
        className={style.tool ?? ""}
        disabled={disabled}
        onClick={run}
      >
        <Sign size={17} aria-hidden />
        {word && <span>{word}</span>}
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

/**
 * The tools that are needed again and again; all others are in the menu at its end. Without a keyboard there are
 * also those that only keys would replace, and the mode that selects several is shown while it is on. `words`:
 * there is room for words.
 */
export const Toolbar = memo(function Toolbar({ words }: { words: boolean }) {
  const { tool, selection } = useEditorContext();
  const fingers = useHasFingersOnly();
  const isSelecting = tool === "select";
  return (
    <div className={style.bar} role="toolbar" aria-label="Canvas tools">
      <Tool editAction={add} word={words && "Add"} />
      {(fingers || isSelecting) && <Tool editAction={marquee} pressed={isSelecting} />}
      <Tool editAction={undo} />
      <Tool editAction={redo} />
      {fingers && selection.size > 0 && <Tool editAction={removeSelection} />}
      {words && <Tool editAction={tidy} word="Tidy" />}
      {words && <Tool editAction={note} word="Note" />}
      {!words && <Tool editAction={fit} />}
      <AllActionsButton />
    </div>
  );
});

function ZoomShown() {
  const percent = useStore(({ transform }) => Math.round(transform[2] * 100));
  return (
    <output className={style.zoom} aria-label="Zoom">
      {percent} %
    </output>
  );
}

/** The zoom of the canvas, and the buttons that change it. */
export const ZoomTools = memo(function ZoomTools() {
  return (
    <div className={style.bar} role="toolbar" aria-label="Zoom">
      <Tool editAction={zoomOut} />
      <ZoomShown />
      <Tool editAction={zoomIn} />
      <Tool editAction={fit} word="Fit" />
    </div>
  );
});
