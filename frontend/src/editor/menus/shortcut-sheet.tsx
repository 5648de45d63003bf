/** The sheet of all keyboard shortcuts; each except that of STOP can be changed. */
import { ActionIcon, Button, Modal, Switch } from "@mantine/core";
import { IconPencil } from "@tabler/icons-react";
import { useState } from "react";
import { EDIT_ACTIONS } from "../../edit-actions/all";
import { type EditAction, type EditActionGroup, printedKeys } from "../../edit-actions/edit-action";
import {
  assigned,
  isChangeable,
  keepOwn,
  type OwnShortcuts,
  refusalOf,
  shortcutOf,
  takenBy,
  useOwnShortcuts,
  withOwn,
} from "../../edit-actions/keys/own-shortcuts";
import { ShortcutKeys, useSingleKeys } from "../../edit-actions/keys/shortcuts";
import { HelpLink } from "../../status/help-link";
import { keyOf } from "../../ui/keys";
import { isolated } from "../../words/isolated";
import style from "./shortcut-sheet.module.css";

interface Props {
  /** The edit action with its default shortcuts. */
  editAction: EditAction;
  own: OwnShortcuts;
  /** Keys for this action are being recorded. */
  changing: boolean;
  setChanging: (name: string | null) => void;
}

interface Wish {
  readonly keys: string;
  /** The reason why the keys cannot be assigned at once. */
  readonly problem: string;
  /** True if the other actions that have these keys can lose them. */
  readonly others: boolean;
}

function wishFor(editAction: EditAction, own: OwnShortcuts, keys: string): Wish | null {
  const refused = refusalOf(keys);
  if (refused !== null) return { keys, problem: refused, others: false };
  const others = takenBy(withOwn(EDIT_ACTIONS, own), editAction.name, keys);
  if (others.length === 0) return null;
  const printed = printedKeys(keys).join(" ");
  const names = others.map(({ label }) => `“${isolated(label)}”`).join(", ");
  return {
    keys,
    problem: `${printed} is already used by ${names}.`,
    others: others.every(isChangeable),
  };
}

/** Records the keys that are pressed next. The keys of STOP are never recorded and always work. */
function KeysWanted({ editAction, own, setChanging }: Omit<Props, "changing">) {
  const [wish, setWish] = useState<Wish | null>(null);
  const give = (shortcuts: readonly string[]) => {
    keepOwn(assigned(EDIT_ACTIONS, own, editAction.name, shortcuts));
    setChanging(null);
  };
  const onKeyDown = (event: React.KeyboardEvent) => {
    const key = keyOf(event);
    if (key === "Tab" && !event.ctrlKey && !event.altKey) return; // moves the focus to the buttons
    event.preventDefault();
    event.stopPropagation();
    if (key === "Escape") return setChanging(null);
    const keys = shortcutOf(event);
    if (keys === null || event.repeat) return;
    const problem = wishFor(editAction, own, keys);
    if (problem === null) give([keys]);
    else setWish(problem);
  };
  const changed = own[editAction.name] !== undefined;
  return (
    <div className={style.wanted}>
      {/* biome-ignore lint/a11y/noAutofocus: it was asked for a moment ago */}
      <button type="button" className={style.press} autoFocus onKeyDown={onKeyDown}>
        Press the new keys for “{editAction.label}”
      </button>
      <p className={style.problem} role="status">
        {wish?.problem}
      </p>
      <div className={style.choices}>
        {wish?.others && (
          <Button size="compact-xs" variant="filled" onClick={() => give([wish.keys])}>
            Take them
          </Button>
        )}
        <Button size="compact-xs" onClick={() => give([])}>
          No keys
        </Button>
        {changed && (
          <Button size="compact-xs" onClick={() => give(editAction.shortcuts)}>
            Default keys
          </Button>
        )}
        <Button size="compact-xs" variant="subtle" onClick={() => setChanging(null)}>
          Cancel
        </Button>
      </div>
    </div>
  );
}

function ShortcutRow({ changing, ...props }: Props) {
  const { editAction, own, setChanging } = props;
  const shortcuts = own[editAction.name] ?? editAction.shortcuts;
  return (
    <div className={style.row} data-own={own[editAction.name] !== undefined || undefined}>
      <dt>{editAction.label}</dt>
      <dd>
        {shortcuts.slice(0, 2).map((shortcut) => (
          <ShortcutKeys key={shortcut} shortcut={shortcut} />
        ))}
        {isChangeable(editAction) && (
          <ActionIcon
            size={24}
            aria-label={`Other keys for ${editAction.label}`}
            aria-expanded={changing}
            onClick={() => setChanging(changing ? null : editAction.name)}
          >
            <IconPencil size={13} aria-hidden />
          </ActionIcon>
        )}
        {changing && <KeysWanted {...props} />}
      </dd>
    </div>
  );
}

const GROUPS: readonly EditActionGroup[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];

/** Shortcuts that cannot be changed. */
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
          description="Switch this off if speech input or another device types letters."
        />
        <Switch
          checked={all}
          onChange={(event) => setAll(event.currentTarget.checked)}
          label="Show actions without keys, too"
          description="The pencil assigns keys, on this device."
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
