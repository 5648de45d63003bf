/** The context menu of the canvas. */
import { Menu } from "@mantine/core";
import { Fragment, useEffect, useRef } from "react";
import * as editActions from "../../edit-actions/all";
import { type EditAction, isEnabled, labelOf } from "../../edit-actions/edit-action";
import {
  type EditorContext,
  selectedActions,
  selectedNotes,
  selectedRelations,
} from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcuts";
import style from "./context-menu.module.css";

/** Return the groups of edit actions that fit the selection. */
function offered(context: EditorContext): readonly (readonly EditAction[])[] {
  const actions = selectedActions(context).length;
  const notes = selectedNotes(context).length;
  const arrows = selectedRelations(context).length;
  const {
    copy,
    cut,
    pasteHere,
    duplicate,
    duplicateWith,
    removeSelection: remove,
    removeAndReconnect: heal,
  } = editActions;
  if (actions + notes > 1) {
    return [
      [copy, cut, duplicate, duplicateWith, pasteHere],
      [
        editActions.tidySelection,
        ...editActions.ALIGN,
        ...editActions.DISTRIBUTE,
        editActions.frame,
        editActions.fold,
      ],
      [
        editActions.connectTo,
        editActions.entry,
        editActions.exit,
        editActions.breakpoint,
        editActions.runOnly,
        editActions.dryRunOnly,
        editActions.extract,
        editActions.zoomSelection,
        editActions.copyLink,
      ],
      [remove, heal],
    ];
  }
  if (actions === 1) {
    return [
      [
        editActions.enter,
        editActions.expandGraph,
        editActions.details,
        editActions.connectTo,
        editActions.entry,
        editActions.exit,
        editActions.breakpoint,
      ],
      [editActions.runFrom, editActions.runOnly, editActions.dryRunFrom, editActions.dryRunOnly],
      [copy, cut, duplicate, duplicateWith, pasteHere],
      [editActions.tryAgain, editActions.extract, editActions.unpack],
      [editActions.frame, editActions.zoomSelection, editActions.copyLink, editActions.packages],
      [remove, heal],
    ];
  }
  if (notes === 1) {
    return [
      [editActions.write, editActions.fold],
      [copy, cut, duplicate, editActions.copyLink],
      [remove],
    ];
  }
  if (arrows > 0) {
    return [
      [
        editActions.details,
        editActions.insert,
        editActions.retargetArrow,
        editActions.straightenLine,
        editActions.breakpoint,
      ],
      [editActions.zoomSelection, editActions.copyLink],
      [remove],
    ];
  }
  const end = context.selection.size > 0 ? [editActions.connectTo] : [];
  return [
    [...end, editActions.add, editActions.note, pasteHere],
    [editActions.selectAll, editActions.tidy, editActions.fit, editActions.snap],
    [editActions.palette, editActions.showShortcuts],
  ];
}

interface Props {
  context: EditorContext;
  screen: readonly [number, number];
  onClose: () => void;
}

export function ContextMenu({ context, screen, onClose }: Props) {
  const groups = offered(context)
    .map((group) => group.filter((editAction) => isEnabled(editAction, context)))
    .filter((group) => group.length > 0);
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    // The menu is placed first, then its first item gets the focus.
    const timer = setTimeout(() => box.current?.querySelector("button")?.focus(), 80);
    return () => clearTimeout(timer);
  }, []);
  return (
    <Menu
      opened
      onChange={(opened) => {
        if (!opened) onClose();
      }}
      position="bottom-start"
      offset={2}
      width={250}
      trapFocus
      returnFocus
      transitionProps={{ duration: 60 }}
    >
      <Menu.Target>
        <button
          type="button"
          className={style.spot}
          style={{ left: screen[0], top: screen[1] }}
          tabIndex={-1}
          aria-label="What can be done here"
        />
      </Menu.Target>
      <Menu.Dropdown
        ref={box}
        className={`${style.menu} fingers`}
        onContextMenu={(event) => event.preventDefault()}
      >
        {groups.map((group, i) => (
          <Fragment key={group[0]?.name}>
            {i > 0 && <Menu.Divider />}
            {group.map((editAction) => {
              const Sign = editAction.icon;
              return (
                <Menu.Item
                  key={editAction.name}
                  // else it would close the dialog that the item has just opened
                  closeMenuOnClick={false}
                  leftSection={<Sign size={16} aria-hidden />}
                  rightSection={<FirstShortcut editAction={editAction} />}
                  onClick={() => {
                    onClose();
                    editAction.run(context);
                  }}
                >
                  {labelOf(editAction, context)}
                </Menu.Item>
              );
            })}
          </Fragment>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
