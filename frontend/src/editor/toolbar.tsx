/** Tools on the canvas, and the menu of every deed. */
import { ActionIcon, Kbd, Menu, Tooltip } from "@mantine/core";
import { IconDots } from "@tabler/icons-react";
import { useBench } from "./bench";
import {
  add,
  DEEDS,
  fit,
  marquee,
  pan,
  redo,
  remove,
  tidy,
  undo,
  zoomIn,
  zoomOut,
} from "./deeds/all";
import { type Deed, isEnabled, keysOf, labelOf } from "./deeds/deed";
import style from "./toolbar.module.css";

function Shortcut({ deed }: { deed: Deed }) {
  const [first] = deed.shortcuts;
  if (first === undefined) return null;
  return (
    <span className={style.keys}>
      {keysOf(first).map((key) => (
        <Kbd key={key}>{key}</Kbd>
      ))}
    </span>
  );
}

function Tool({ deed, pressed }: { deed: Deed; pressed?: boolean }) {
  const bench = useBench();
  const Sign = deed.icon;
  return (
    <Tooltip
      label={
        <>
          {labelOf(deed, bench)} <Shortcut deed={deed} />
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
        disabled={!isEnabled(deed, bench)}
        onClick={() => deed.run(bench)}
      >
        <Sign size={17} aria-hidden />
      </ActionIcon>
    </Tooltip>
  );
}

export function DeedMenu() {
  const bench = useBench();
  return (
    <Menu position="top-start" width={230}>
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
      <Menu.Dropdown>
        {DEEDS.map((deed) => {
          const Sign = deed.icon;
          return (
            <Menu.Item
              key={deed.name}
              leftSection={<Sign size={16} aria-hidden />}
              rightSection={<Shortcut deed={deed} />}
              disabled={!isEnabled(deed, bench)}
              onClick={() => deed.run(bench)}
            >
              {labelOf(deed, bench)}
            </Menu.Item>
          );
        })}
      </Menu.Dropdown>
    </Menu>
  );
}

export function Toolbar({ compact }: { compact: boolean }) {
  const { tool, selection } = useBench();
  return (
    <div className={style.bar} role="toolbar" aria-label="Canvas tools">
      <Tool deed={add} />
      {!compact && <Tool deed={marquee} pressed={tool === "select"} />}
      {!compact && <Tool deed={pan} pressed={tool === "pan"} />}
      <Tool deed={undo} />
      <Tool deed={redo} />
      {(!compact || selection.size > 0) && <Tool deed={remove} />}
      {!compact && <Tool deed={tidy} />}
      {!compact && <Tool deed={zoomOut} />}
      {!compact && <Tool deed={zoomIn} />}
      <Tool deed={fit} />
      <DeedMenu />
    </div>
  );
}
