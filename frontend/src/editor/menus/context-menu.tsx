/** The menu of what was pressed, at the place where it was pressed. */
import { Menu } from "@mantine/core";
import { Fragment, useEffect, useRef } from "react";
import * as deeds from "../../edit-actions/all";
import { type Deed, isEnabled, labelOf } from "../../edit-actions/edit-action";
import {
  type EditorContext,
  selectedActions,
  selectedNotes,
  selectedRelations,
} from "../../edit-actions/editor-context";
import { Shortcut } from "../../edit-actions/shortcut-keys";
import style from "./context-menu.module.css";

/** What can be done with the selection, in groups. */
export function offered(context: EditorContext): readonly (readonly Deed[])[] {
  const actions = selectedActions(context).length;
  const notes = selectedNotes(context).length;
  const arrows = selectedRelations(context).length;
  const { copy, cut, pasteHere, duplicate, remove, heal } = deeds;
  if (actions + notes > 1) {
    return [
      [copy, cut, duplicate, pasteHere],
      [deeds.tidySelection, ...deeds.ALIGN, ...deeds.DISTRIBUTE, deeds.frame],
      [deeds.connectTo, deeds.entry, deeds.exit, deeds.zoomSelection, deeds.copyLink],
      [remove, heal],
    ];
  }
  if (actions === 1) {
    return [
      [deeds.details, deeds.connectTo, deeds.entry, deeds.exit],
      [copy, cut, duplicate, pasteHere],
      [deeds.frame, deeds.zoomSelection, deeds.copyLink],
      [remove, heal],
    ];
  }
  if (notes === 1) return [[deeds.write], [copy, cut, duplicate, deeds.copyLink], [remove]];
  if (arrows > 0) {
    return [
      [deeds.details, deeds.insert, deeds.retarget],
      [deeds.zoomSelection, deeds.copyLink],
      [remove],
    ];
  }
  const end = context.selection.size > 0 ? [deeds.connectTo] : [];
  return [
    [...end, deeds.add, deeds.note, pasteHere],
    [deeds.selectAll, deeds.tidy, deeds.fit, deeds.snap],
    [deeds.palette, deeds.keys],
  ];
}

interface Props {
  context: EditorContext;
  screen: readonly [number, number];
  onClose: () => void;
}

export function ContextMenu({ context, screen, onClose }: Props) {
  const groups = offered(context)
    .map((group) => group.filter((deed) => isEnabled(deed, context)))
    .filter((group) => group.length > 0);
  const box = useRef<HTMLDivElement>(null);
  useEffect(() => {
    // The menu is placed first; then its first line has the keys.
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
        <span className={style.spot} style={{ left: screen[0], top: screen[1] }} />
      </Menu.Target>
      <Menu.Dropdown
        ref={box}
        className={style.menu ?? ""}
        onContextMenu={(event) => event.preventDefault()}
      >
        {groups.map((group, i) => (
          <Fragment key={group[0]?.name}>
            {i > 0 && <Menu.Divider />}
            {group.map((deed) => {
              const Sign = deed.icon;
              return (
                <Menu.Item
                  key={deed.name}
                  leftSection={<Sign size={16} aria-hidden />}
                  rightSection={<Shortcut deed={deed} />}
                  onClick={() => {
                    onClose();
                    deed.run(context);
                  }}
                >
                  {labelOf(deed, context)}
                </Menu.Item>
              );
            })}
          </Fragment>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
