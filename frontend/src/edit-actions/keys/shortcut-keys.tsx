/** The first shortcut of an edit action, as it is printed on keys. */
import { Kbd } from "@mantine/core";
import style from "../../editor/menus/toolbar.module.css";
import { EDIT_ACTIONS } from "../all";
import { type EditAction, printedKeys } from "../edit-action";
import { useOwnShortcuts } from "./own-shortcuts";

export function ShortcutKeys({ shortcut }: { shortcut: string }) {
  return (
    <span className={style.keys}>
      {printedKeys(shortcut).map((key) => (
        <Kbd key={key}>{key}</Kbd>
      ))}
    </span>
  );
}

export function FirstShortcut({ editAction }: { editAction: EditAction }) {
  const own = useOwnShortcuts(EDIT_ACTIONS);
  const [first] = own[editAction.name] ?? editAction.shortcuts;
  return first === undefined ? null : <ShortcutKeys shortcut={first} />;
}
