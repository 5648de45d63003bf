/** Handles of the outcomes of a chosen arrow, on its pill: each can be led to another card. */

import { keyOf } from "../ui/keys";
import { useOutcomeDrag } from "./arrows/outcome-drag";
import { OutcomeSign, outcomeColor, outcomeWord } from "./outcome";
import style from "./outcome-arrow.module.css";

export function OutcomeHandles(props: Parameters<typeof useOutcomeDrag>[0]) {
  const { bundle, editing } = props;
  const drag = useOutcomeDrag(props);
  const line = editing.nameOf(bundle);
  return bundle.outcomes.map((outcome) => (
    <button
      key={outcome}
      type="button"
      className={`${style.handle} nodrag nopan`}
      data-own-keys
      data-dragged={drag.dragged === outcome || undefined}
      aria-label={`Lead “${outcomeWord[outcome]}” of ${line} elsewhere`}
      style={{ color: outcomeColor[outcome] }}
      onPointerDown={drag.start}
      onPointerMove={(event) => drag.move(event, outcome)}
      onPointerUp={drag.drop}
      onPointerCancel={drag.stop}
      // The arrow has its own answer to these two; every other key is a shortcut as elsewhere.
      onKeyDown={(event) => {
        if (["Enter", " "].includes(keyOf(event))) event.stopPropagation();
      }}
      onClick={(event) => {
        event.stopPropagation();
        // A press of Enter or Space has no pointer, hence no clicks to count.
        if (event.detail === 0) editing.choose(bundle, outcome);
      }}
    >
      <OutcomeSign outcome={outcome} size={11} />
    </button>
  ));
}
