/** The command palette: all edit actions with their shortcuts, the actions of this graph, and all graphs. */

import { useDebouncedValue } from "@mantine/hooks";
import { IconRouteSquare2, IconSquareRounded } from "@tabler/icons-react";
import { type KeyboardEvent, useLayoutEffect, useMemo, useRef, useState } from "react";
import { createPortal } from "react-dom";
import { useLocation } from "wouter";
import { useGraphPages } from "../../api/graph-list";
import type { GraphSummary } from "../../api/graphs";
import { EDIT_ACTIONS } from "../../edit-actions/all";
import { isEnabled, labelOf } from "../../edit-actions/edit-action";
import type { EditorContext } from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcuts";
import { keyOf } from "../../ui/keys";
import { colorOfName } from "../../ui/name-colors";
import { matching, type Option, PickList } from "../../ui/pick-list";
import style from "./command-palette.module.css";

const MOST = 60;
const PAUSE = 150; // ms without a key before the server is asked
/** Names of recently used edit actions, the latest first. */
let recent: readonly string[] = [];

function commandOptions(context: EditorContext): Option[] {
  const rank = (name: string) => {
    const at = recent.indexOf(name);
    return at < 0 ? recent.length : at;
  };
  return EDIT_ACTIONS.filter(({ name }) => name !== "palette")
    .map((editAction) => {
      const Sign = editAction.icon;
      return {
        id: `command ${editAction.name}`,
        label: labelOf(editAction, context),
        also: `${editAction.also ?? ""} ${editAction.group}`,
        group: "Commands",
        icon: <Sign size={16} aria-hidden />,
        right: <FirstShortcut editAction={editAction} />,
        disabled: !isEnabled(editAction, context),
        rank: rank(editAction.name),
      };
    })
    .sort((a, b) => Number(a.disabled) - Number(b.disabled) || a.rank - b.rank);
}

function actionOptions({ graph }: EditorContext): Option[] {
  return graph.actions.map(({ key, name, instanceId, actor, description }) => ({
    id: `action ${key}`,
    label: `${name} ${instanceId}`,
    sub: [actor, description].filter(Boolean).join(" · "),
    also: "go to action",
    group: "Actions of this graph",
    icon: <IconSquareRounded size={16} aria-hidden style={{ color: colorOfName(actor) }} />,
  }));
}

function graphOptions(graphs: readonly GraphSummary[]): Option[] {
  return graphs.map(({ id, name, description, robots = [], labels = [] }) => ({
    id: `graph ${id}`,
    label: name || "Untitled",
    sub: description,
    also: ["go to open graph", ...robots, ...labels].join(" "),
    group: "Graphs",
    icon: <IconRouteSquare2 size={16} aria-hidden />,
  }));
}

/** The graphs that changed last, and those of all others that the server finds by a search. */
function useFoundGraphs(search: string) {
  const [asked] = useDebouncedValue(search, PAUSE);
  const newest = useGraphPages({ search: "" });
  const found = useGraphPages({ search: newest.hasMore ? asked.trim() : "" });
  return { newest: newest.graphs, found: found.graphs };
}

export function CommandPalette({
  context,
  onClose,
}: {
  context: EditorContext;
  onClose: () => void;
}) {
  const [, go] = useLocation();
  const palette = useRef<HTMLDialogElement>(null);
  useLayoutEffect(() => {
    const dialog = palette.current;
    dialog?.show();
    return () => dialog?.close(); // returns the focus
  }, []);
  const [search, setSearch] = useState("");
  const { newest, found } = useFoundGraphs(search);
  // Computed once: the order must not change while the person chooses.
  const first = useRef(context);
  const options = useMemo<Option[]>(
    () => [
      ...commandOptions(first.current),
      ...actionOptions(first.current),
      ...graphOptions((newest ?? []).filter(({ id }) => id !== first.current.id)),
    ],
    [newest],
  );
  // They come last, so that what has been chosen stays where it is when they arrive.
  const later = useMemo(() => {
    const known = new Set(newest?.map(({ id }) => id)).add(first.current.id);
    return graphOptions((found ?? []).filter(({ id }) => !known.has(id)));
  }, [newest, found]);
  const onPick = (id: string) => {
    const [kind = "", key = ""] = id.split(" ");
    palette.current?.close(); // an open dialog would keep the focus
    onClose();
    if (kind === "graph") go(`/graphs/${encodeURIComponent(key)}`);
    else if (kind === "action") {
      context.select([key]);
      context.view.show([key]);
      context.view.focus(key);
    } else {
      recent = [key, ...recent.filter((name) => name !== key)].slice(0, 5);
      // After the palette has returned the focus.
      setTimeout(() => EDIT_ACTIONS.find(({ name }) => name === key)?.run(context), 0);
    }
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const key = keyOf(event);
    if (key === "Escape") onClose();
    else if (key !== "Tab") return; // the field is the only element that can have the focus
    event.preventDefault();
    event.stopPropagation();
  };
  // A dialog element of the browser opens at once, before any library is loaded. It is not modal: a
  // modal dialog would block STOP.
  return createPortal(
    <>
      <div className={style.backdrop} onPointerDown={onClose} />
      <dialog
        ref={palette}
        className={style.palette}
        aria-label="Commands"
        aria-modal
        onKeyDown={onKeyDown}
      >
        <PickList
          label="Find a command, an action or a graph"
          placeholder="What do you want to do, or where to go?"
          find={(words) => [
            ...matching(options, words).slice(0, MOST),
            ...matching(later, words).slice(0, MOST),
          ]}
          onSearch={setSearch}
          onPick={onPick}
          none="Nothing has this name."
          take="do it"
        />
      </dialog>
    </>,
    document.body,
  );
}
