/** Every shortcut on one sheet, and the switch for single letters. */
import { Modal, Switch } from "@mantine/core";
import { EDIT_ACTIONS } from "../../edit-actions/all";
import type { EditActionGroup } from "../../edit-actions/edit-action";
import { ShortcutKeys } from "../../edit-actions/shortcut-keys";
import { useSingleKeys } from "../../edit-actions/shortcuts";
import style from "./shortcut-sheet.module.css";

const GROUPS: readonly EditActionGroup[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];

export function ShortcutSheet({ onClose }: { onClose: () => void }) {
  const [singles, setSingles] = useSingleKeys();
  return (
    <Modal opened onClose={onClose} title="Keyboard shortcuts" size="xl">
      <Switch
        checked={singles}
        onChange={(event) => setSingles(event.currentTarget.checked)}
        label="Single letters are shortcuts"
        description="Switch this off if speech or another device types letters by itself."
      />
      <div className={style.groups}>
        {GROUPS.map((group) => (
          <section key={group} className={style.group}>
            <h3>{group}</h3>
            <dl>
              {EDIT_ACTIONS.filter(
                (editAction) => editAction.group === group && editAction.shortcuts.length > 0,
              ).map((editAction) => (
                <div key={editAction.name} className={style.row}>
                  <dt>{editAction.label}</dt>
                  <dd>
                    {editAction.shortcuts.slice(0, 2).map((shortcut) => (
                      <ShortcutKeys key={shortcut} shortcut={shortcut} />
                    ))}
                  </dd>
                </div>
              ))}
            </dl>
          </section>
        ))}
        <section className={style.group}>
          <h3>On the canvas</h3>
          <dl>
            <div className={style.row}>
              <dt>Next and previous action or arrow</dt>
              <dd>
                <ShortcutKeys shortcut="Tab" />
                <ShortcutKeys shortcut="Shift+Tab" />
              </dd>
            </div>
            <div className={style.row}>
              <dt>Choose what has the focus</dt>
              <dd>
                <ShortcutKeys shortcut="Enter" />
              </dd>
            </div>
            <div className={style.row}>
              <dt>Search for an action, the pointer over the canvas</dt>
              <dd>
                <ShortcutKeys shortcut="Tab" />
              </dd>
            </div>
            <div className={style.row}>
              <dt>Search graphs and actions</dt>
              <dd>
                <ShortcutKeys shortcut="/" />
              </dd>
            </div>
          </dl>
        </section>
      </div>
    </Modal>
  );
}
