/** An action of the library: dragged or tapped onto the canvas; what it takes, and where it is used. */
import { IconInfoCircle } from "@tabler/icons-react";
import { memo } from "react";
import { actionDrag } from "../canvas/action-drag";
import type { NewAction } from "../graph/edit";
import { LateOpening } from "../ui/floating/late-opening";
import { lazyPart } from "../ui/parts/lazy-part";
import { isolated } from "../words/isolated";
import { type KnownAction, signature } from "./known-actions";
import style from "./sidebar.module.css";

const ActionFacts = lazyPart(() => import("./action-facts").then((part) => part.ActionFacts));

function About({ known }: { known: KnownAction }) {
  return (
    <LateOpening opens="menu" part={(button) => <ActionFacts button={button} known={known} />}>
      <button
        type="button"
        className={style.about}
        aria-label={`About ${isolated(known.template.name)}`}
      >
        <IconInfoCircle size={15} aria-hidden />
      </button>
    </LateOpening>
  );
}

interface Props {
  known: KnownAction;
  /** What is said after its parameters. */
  note?: string;
  onPlace: (template: NewAction) => void;
}

// There may be a thousand: while somebody types, those that stay are not drawn again.
export const ActionRow = memo(function ActionRow({ known, note = "", onPlace }: Props) {
  const { template, usedIn } = known;
  return (
    <div className={style.action}>
      <button
        type="button"
        className={style.row}
        title={template.description || template.name}
        onPointerDown={(event) => actionDrag.press(event, template, template.name)}
        onClick={() => onPlace(template)}
      >
        <span className={style.grip} aria-hidden />
        <span className={style.text}>
          <span className={style.name}>{template.name}</span>
          <span className={style.sub}>
            {signature(template)}
            {usedIn.length > 0 && ` · used in ${usedIn.length}`}
            {note !== "" && ` · ${note}`}
          </span>
        </span>
      </button>
      {usedIn.length > 0 && <About known={known} />}
    </div>
  );
});
