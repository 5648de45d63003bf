/** Counts of what differs, and a walk from change to change by mouse and by the keys N and P. */
import { ActionIcon } from "@mantine/core";
import { IconChevronLeft, IconChevronRight } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import { CHANGE_SIGNS } from "../canvas/marks/change-marks";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { useSingleKeys } from "../edit-actions/keys/shortcuts";
import { endsOf } from "../graph/document-keys";
import { keyOf } from "../ui/keys";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import { type ChangedThing, countWords, type GraphChanges, walkOrder } from "./graph-difference";
import style from "./past-bar.module.css";

const KINDS = ["added", "removed", "changed"] as const;

/** Shows it on the canvas: an arrow with what it joins. */
export function showThing({ select, view }: EditorContext, { key, thing }: ChangedThing): void {
  select(thing === "graph" ? [] : [key]);
  const ends = thing === "arrow" ? endsOf(key) : null;
  if (thing !== "graph") view.show(ends ? [ends.parent, ends.child] : [key]);
}

function thingWords({ name, change, looks, lines }: ChangedThing): string {
  if (looks) return `${isolated(name)}: only its position`;
  const [line] = lines;
  if (change !== "changed" || line === undefined) return `${name} ${change}`;
  const more = lines.length > 1 ? ` and ${lines.length - 1} more` : "";
  return `${isolated(name)}: ${isolated(line.name)} ${line.before ?? "nothing"} → ${line.after ?? "nothing"}${more}`;
}

/** N and P, wherever nobody is typing. */
function useWalkKeys(go: (by: 1 | -1) => void): void {
  const [singles] = useSingleKeys();
  const now = useRef(go);
  now.current = go;
  useEffect(() => {
    if (!singles) return;
    const onKey = (event: KeyboardEvent) => {
      const by = { n: 1, p: -1 }[keyOf(event)] ?? null;
      const typed =
        "input:not([type=range], [type=radio], [type=checkbox]), textarea, select, [role=dialog], [role=menu]";
      const taken = event.target instanceof Element && event.target.closest(typed) !== null;
      if (by === null || taken || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      now.current(by as 1 | -1);
    };
    // Before the shortcuts of the editor, which have other uses for these letters.
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  }, [singles]);
}

function Legend({ things }: { things: readonly ChangedThing[] }) {
  const looks = things.filter((thing) => thing.looks).length;
  return (
    <ul className={style.legend} aria-label="What differs">
      {KINDS.map((kind) => {
        const words = countWords(things, kind);
        if (words === "") return null;
        return (
          <li key={kind} data-change={kind}>
            <i aria-hidden>{CHANGE_SIGNS[kind]}</i> {words}{" "}
            <span className="visually-hidden">{kind}</span>
          </li>
        );
      })}
      {looks > 0 && <li>{looks} only moved</li>}
      {things.length === 0 && <li>Nothing differs</li>}
    </ul>
  );
}

export function ChangesWalk({ changes }: { changes: GraphChanges }) {
  const context = useEditorContext();
  const [at, setAt] = useState(-1);
  const order = walkOrder(changes.things);
  const count = order.length;
  const here = order[at];
  const go = (by: 1 | -1) => {
    if (count === 0) return;
    const next = at < 0 ? (by === 1 ? 0 : count - 1) : (at + by + count) % count;
    const thing = order[Math.min(next, count - 1)];
    setAt(next);
    if (thing) showThing(context, thing);
  };
  useWalkKeys(go);
  return (
    <>
      <Legend things={changes.things} />
      {count > 0 && (
        // biome-ignore lint/a11y/useSemanticElements: a fieldset cannot be laid out as a row everywhere
        <div className={style.walk} role="group" aria-label="Changes one by one">
          <Tooltip label="The change before (P)">
            <ActionIcon aria-label="The change before" onClick={() => go(-1)}>
              <IconChevronLeft size={17} aria-hidden />
            </ActionIcon>
          </Tooltip>
          <span className="min-w-0 truncate" role="status">
            {here ? `${at + 1} of ${count} · ${thingWords(here)}` : `${count} to look at`}
          </span>
          <Tooltip label="The next change (N)">
            <ActionIcon aria-label="The next change" onClick={() => go(1)}>
              <IconChevronRight size={17} aria-hidden />
            </ActionIcon>
          </Tooltip>
        </div>
      )}
    </>
  );
}
