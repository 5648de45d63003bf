/** Every shortcut on one sheet, and the switch for single letters. */
import { Modal, Switch } from "@mantine/core";
import { DEEDS } from "../../edit-actions/all";
import type { Group } from "../../edit-actions/edit-action";
import { Keys } from "../../edit-actions/shortcut-keys";
import { useSingleKeys } from "../../edit-actions/shortcuts";
import style from "./shortcut-sheet.module.css";

const GROUPS: readonly Group[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];

export function KeysSheet({ onClose }: { onClose: () => void }) {
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
              {DEEDS.filter((deed) => deed.group === group && deed.shortcuts.length > 0).map(
                (deed) => (
                  <div key={deed.name} className={style.row}>
                    <dt>{deed.label}</dt>
                    <dd>
                      {deed.shortcuts.slice(0, 2).map((shortcut) => (
                        <Keys key={shortcut} shortcut={shortcut} />
                      ))}
                    </dd>
                  </div>
                ),
              )}
            </dl>
          </section>
        ))}
        <section className={style.group}>
          <h3>On the canvas</h3>
          <dl>
            <div className={style.row}>
              <dt>Next and previous action or arrow</dt>
              <dd>
                <Keys shortcut="Tab" />
                <Keys shortcut="Shift+Tab" />
              </dd>
            </div>
            <div className={style.row}>
              <dt>Choose what has the focus</dt>
              <dd>
                <Keys shortcut="Enter" />
              </dd>
            </div>
            <div className={style.row}>
              <dt>Search for an action, the pointer over the canvas</dt>
              <dd>
                <Keys shortcut="Tab" />
              </dd>
            </div>
            <div className={style.row}>
              <dt>Search graphs and actions</dt>
              <dd>
                <Keys shortcut="/" />
              </dd>
            </div>
          </dl>
        </section>
      </div>
    </Modal>
  );
}
