/** Everything that differs between the two moments, field by field; each leads to its place. */
import { memo } from "react";
import { CHANGE_SIGNS } from "../../canvas/changes/change-marks";
import { useEditorContext } from "../../edit-actions/editor-context";
import style from "../past-details.module.css";
import { showThing } from "./changes-walk";
import { type ChangedThing, type GraphChanges, walkOrder } from "./graph-difference";

const MOST = 200; // things in the list

function Thing({ thing }: { thing: ChangedThing }) {
  const context = useEditorContext();
  const { name, change, looks, lines } = thing;
  return (
    <li className={style.thing} data-change={looks ? "looks" : change}>
      <button type="button" onClick={() => showThing(context, thing)}>
        <i aria-hidden>{looks ? "·" : CHANGE_SIGNS[change]}</i>
        <span>
          <b>{name}</b> <span className={style.quiet}>{looks ? "only moved" : change}</span>
          {lines.map((line) => (
            <span key={line.name} className={style.change}>
              {line.name} <del>{line.before ?? ""}</del> → <code>{line.after ?? "nothing"}</code>
            </span>
          ))}
        </span>
      </button>
    </li>
  );
}

/** Draws again only for other changes: who steps through moments waits for the canvas, not for the list. */
export const DifferenceList = memo(function DifferenceList({ changes }: { changes: GraphChanges }) {
  const order = walkOrder(changes.things);
  if (order.length === 0) return <p className={style.quiet}>Nothing differs.</p>;
  const more = order.length - MOST;
  return (
    <ul className={style.fields} aria-label="What differs, one by one">
      {order.slice(0, MOST).map((thing) => (
        <Thing key={`${thing.thing} ${thing.key}`} thing={thing} />
      ))}
      {more > 0 && <li className={style.quiet}>and {more} more</li>}
    </ul>
  );
});
