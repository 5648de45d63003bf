/** One problem as a sentence: what is wrong or to fill in, what mends it, and its code at the end. */
import { notifications } from "@mantine/notifications";
import { IconAlertTriangle, IconPencil } from "@tabler/icons-react";
import { useEditorContext } from "../../edit-actions/editor-context";
import { ABOUT, applyFix, fixOf } from "../../graph/edit/fixes";
import type { CheckedGroup } from "./field-problems";
import style from "./problem-note.module.css";

export function tellNothingLeft(): void {
  notifications.show({ message: "There was nothing left to fix.", autoClose: 4_000 });
}

/** A button that applies the fix of the first of its problems that has one, to all that have one. */
function FixLink({ told }: { told: CheckedGroup }) {
  const { doc, mayEdit } = useEditorContext();
  const mended = told.problems.filter((problem) => fixOf(problem) !== null);
  const fix = mended[0] && fixOf(mended[0]);
  if (!fix || !mayEdit) return null;
  return (
    <button
      type="button"
      className={style.fix}
      aria-label={`Fix ${told.code}: ${ABOUT[fix].words}`}
      onClick={() => {
        const done = mended.filter((problem) => applyFix(doc, problem));
        if (done.length === 0) tellNothingLeft();
      }}
    >
      {ABOUT[fix].words}
    </button>
  );
}

export function ProblemNote({ told }: { told: CheckedGroup }) {
  const Sign = told.kind === "fill-in" ? IconPencil : IconAlertTriangle;
  return (
    <p className={style.note} data-kind={told.kind} data-code={told.code}>
      <Sign size={13} aria-hidden />
      <span>
        {told.message} <FixLink told={told} />{" "}
        <small className="ink3 text-11 mono">{told.code}</small>
      </span>
    </p>
  );
}
