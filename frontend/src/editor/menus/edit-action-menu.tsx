/** The menu with all edit actions. */
import { Menu } from "@mantine/core";
import { Fragment, type ReactElement } from "react";
import { EDIT_ACTIONS } from "../../edit-actions/all";
import { type EditActionGroup, isEnabled, labelOf } from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcuts";
import { useOpening } from "../../ui/late-opening";
import style from "./toolbar.module.css";

const GROUPS: readonly EditActionGroup[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];
/** Actions for navigation and nudging, which are useful as keys only. */
const KEYS_ONLY = /^(nudge|walk)-/;

/** Renders only while the menu is open, since everything may change which items are enabled. */
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

export function EditActionMenu({ button }: { button: ReactElement }) {
  const [opened, setOpened] = useOpening();
  return (
    <Menu position="top-start" width={290} opened={opened} onChange={setOpened}>
      <Menu.Target>{button}</Menu.Target>
      <Menu.Dropdown className={`${style.menu} fingers`}>
        <ActionItems />
      </Menu.Dropdown>
    </Menu>
  );
}
