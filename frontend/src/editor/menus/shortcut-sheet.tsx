/** Every shortcut on one sheet: each can be changed, but for STOP's. */
import { Button, Modal, Switch } from "@mantine/core";
import { useState } from "react";
import { EDIT_ACTIONS } from "../../edit-actions/all";
import type { EditActionGroup } from "../../edit-actions/edit-action";
import { keepOwn, useOwnShortcuts } from "../../edit-actions/keys/own-shortcuts";
import { ShortcutKeys } from "../../edit-actions/keys/shortcut-keys";
import { useSingleKeys } from "../../edit-actions/keys/shortcuts";
import { HelpLink } from "../../status/help-link";
import { ShortcutRow } from "./shortcut-row";
import style from "./shortcut-sheet.module.css";

const GROUPS: readonly EditActionGroup[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];

/** What is the same for everybody. */
const FIXED: readonly (readonly [label: string, ...shortcuts: string[]])[] = [
  ["Stop everything that runs, from anywhere", "Mod+."],
  ["Next and previous action or arrow", "Tab", "Shift+Tab"],
  ["Choose what has the focus", "Enter"],
  ["Search for an action, the pointer over the canvas", "Tab"],
  ["Search graphs and actions", "/"],
];

function FixedShortcuts() {
  return (
    <section className={style.group}>
      <h3>Always</h3>
      <dl>
        {FIXED.map(([label, ...shortcuts]) => (
          <div key={label} className={style.row}>
            <dt>{label}</dt>
            <dd>
              {shortcuts.map((shortcut) => (
                <ShortcutKeys key={shortcut} shortcut={shortcut} />
              ))}
            </dd>
          </div>
        ))}
      </dl>
    </section>
  );
}

export function ShortcutSheet({ onClose }: { onClose: () => void }) {
  const [singles, setSingles] = useSingleKeys();
  const own = useOwnShortcuts(EDIT_ACTIONS);
  const [changing, setChanging] = useState<string | null>(null);
  const [all, setAll] = useState(false);
  return (
    <Modal
      opened
      onClose={onClose}
      closeOnEscape={changing === null}
      title="Keyboard shortcuts"
      size="xl"
    >
      <div className={style.head}>
        <Switch
          checked={singles}
          onChange={(event) => setSingles(event.currentTarget.checked)}
          label="Single letters are shortcuts"
          description="Switch this off if speech or another device types letters by itself."
        />
        <Switch
          checked={all}
          onChange={(event) => setAll(event.currentTarget.checked)}
          label="Show what has no keys, too"
          description="The pencil gives keys, on this device."
        />
        {Object.keys(own).length > 0 && (
          <Button size="compact-sm" onClick={() => keepOwn({})}>
            Reset all keys
          </Button>
        )}
        <HelpLink place="drawing.html#with-keys" words="Help: drawing" />
      </div>
      <div className={style.groups}>
        <FixedShortcuts />
        {GROUPS.map((group) => (
          <section key={group} className={style.group}>
            <h3>{group}</h3>
            <dl>
              {EDIT_ACTIONS.filter(
                ({ group: its, name, shortcuts }) =>
                  its === group && (all || name in own || shortcuts.length > 0),
              ).map((editAction) => (
                <ShortcutRow
                  key={editAction.name}
                  editAction={editAction}
                  own={own}
                  changing={changing === editAction.name}
                  setChanging={setChanging}
                />
              ))}
            </dl>
          </section>
        ))}
      </div>
    </Modal>
  );
}
