/** Tools on the canvas, and the menu of every deed. */
import { ActionIcon, Menu, Tooltip } from "@mantine/core";
import { IconDots } from "@tabler/icons-react";
import { Fragment, memo } from "react";
import {
  add,
  DEEDS,
  dryRun,
  fit,
  marquee,
  note,
  pan,
  redo,
  remove,
  snap,
  tidy,
  undo,
  zoomIn,
  zoomOut,
} from "../../edit-actions/all";
import { type Deed, type Group, isEnabled, labelOf } from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import { Shortcut } from "../../edit-actions/shortcut-keys";
import { useSteady } from "../../ui/use-stable-callback";
import style from "./toolbar.module.css";

function Tool({ deed, pressed }: { deed: Deed; pressed?: boolean }) {
  const context = useEditorContext();
  const run = useSteady(() => deed.run(context));
  const parts = { label: labelOf(deed, context), disabled: !isEnabled(deed, context), run };
  return <ToolButton deed={deed} {...parts} {...(pressed === undefined ? {} : { pressed })} />;
}

interface ToolButtonProps {
  deed: Deed;
  label: string;
  disabled: boolean;
  pressed?: boolean;
  run: () => void;
}

/** Drawn again only when it looks different, which edits seldom make it. */
const ToolButton = memo(function ToolButton(props: ToolButtonProps) {
  const { deed, label, disabled, pressed, run } = props;
  const Sign = deed.icon;
  return (
    <Tooltip
      label={
        <>
          {label} <Shortcut deed={deed} />
        </>
      }
    >
      <ActionIcon
        size={34}
        radius={0}
        aria-label={deed.label}
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

const GROUPS: readonly Group[] = ["Draw", "Arrange", "Look", "Graph", "Dry-run"];
/** Walking and nudging would be eight lines that nobody clicks. */
const KEYS_ONLY = /^(nudge|walk)-/;

/** Rendered while the menu is open only: what is enabled depends on everything. */
function DeedItems() {
  const context = useEditorContext();
  return GROUPS.map((group) => (
    <Fragment key={group}>
      <Menu.Label>{group}</Menu.Label>
      {DEEDS.filter((deed) => deed.group === group && !KEYS_ONLY.test(deed.name)).map((deed) => {
        const Sign = deed.icon;
        return (
          <Menu.Item
            key={deed.name}
            leftSection={<Sign size={16} aria-hidden />}
            rightSection={<Shortcut deed={deed} />}
            disabled={!isEnabled(deed, context)}
            onClick={() => deed.run(context)}
          >
            {labelOf(deed, context)}
          </Menu.Item>
        );
      })}
    </Fragment>
  ));
}

export function DeedMenu() {
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
        <DeedItems />
      </Menu.Dropdown>
    </Menu>
  );
}

export const Toolbar = memo(function Toolbar({ compact }: { compact: boolean }) {
  const { tool, selection, snap: snapping, dryRun: dry } = useEditorContext();
  return (
    <div className={style.bar} role="toolbar" aria-label="Canvas tools">
      <Tool deed={add} />
      <Tool deed={marquee} pressed={tool === "select"} />
      {!compact && <Tool deed={pan} pressed={tool === "pan"} />}
      <Tool deed={undo} />
      <Tool deed={redo} />
      {(!compact || selection.size > 0) && <Tool deed={remove} />}
      {!compact && <Tool deed={note} />}
      {!compact && <Tool deed={tidy} />}
      {!compact && <Tool deed={snap} pressed={snapping} />}
      {!compact && <Tool deed={zoomOut} />}
      {!compact && <Tool deed={zoomIn} />}
      <Tool deed={fit} />
      <Tool deed={dryRun} pressed={dry !== null} />
      <DeedMenu />
    </div>
  );
});
