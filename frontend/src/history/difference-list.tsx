/**
 * List of all differences between two moments, field by field; each entry shows its place on the
 * canvas.
 */
import { memo, useMemo } from "react";
import { CHANGE_SIGNS } from "../canvas/marks/change-marks";
import { useEditorContext } from "../edit-actions/editor-context";
import { useStableCallback } from "../ui/hooks";
import { isolated } from "../words/isolated";
import { showThing } from "./changes-walk";
import { type ChangedThing, type GraphChanges, walkOrder } from "./graph-difference";
import style from "./past-details.module.css";

const MOST = 200; // things in the list

interface ThingProps {
  thing: ChangedThing;
  onShow: (thing: ChangedThing) => void;
}

/** Return whether two changes are about the same thing with the same words. */
const isSameThing = (one: ChangedThing, other: ChangedThing): boolean =>
  one.key === other.key &&
  one.thing === other.thing &&
  one.change === other.change &&
  one.looks === other.looks &&
  one.name === other.name &&
  (one.lines === other.lines || one.lines.length + other.lines.length === 0);

const Thing = memo(
  function Thing({ thing, onShow }: ThingProps) {
    const { name, change, looks, lines } = thing;
    return (
      <li className={style.thing} data-change={looks ? "looks" : change}>
        <button type="button" onClick={() => onShow(thing)}>
          <i aria-hidden>{looks ? "·" : CHANGE_SIGNS[change]}</i>
          <span>
            <b>{name}</b> <span className="ink2">{looks ? "only moved" : change}</span>
            {lines.map((line) => (
              <span key={line.name} className="block ink2">
                {isolated(line.name)} <del>{line.before ?? ""}</del> →{" "}
                <code>{line.after ?? "nothing"}</code>
              </span>
            ))}
          </span>
        </button>
      </li>
    );
  },
  (one, other) => one.onShow === other.onShow && isSameThing(one.thing, other.thing),
);

/** Rows draw again only where they say something else: who steps through moments waits for the canvas. */
export function DifferenceList({ changes }: { changes: GraphChanges }) {
  const context = useEditorContext();
  const onShow = useStableCallback((thing: ChangedThing) => showThing(context, thing));
  const order = useMemo(() => walkOrder(changes.things), [changes]);
  if (order.length === 0) return <p className="ink2">Nothing differs.</p>;
  const more = order.length - MOST;
  return (
    <ul className={style.fields} aria-label="What differs, one by one">
      {order.slice(0, MOST).map((thing) => (
        <Thing key={`${thing.thing} ${thing.key}`} thing={thing} onShow={onShow} />
      ))}
      {more > 0 && <li className="ink2">and {more} more</li>}
    </ul>
  );
}
