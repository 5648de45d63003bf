/** How many problems the graph has, in words; opens their list. */
import { IconAlertTriangle } from "@tabler/icons-react";
import type { Problems } from "../api/graphs";
import { useEditorContext } from "../edit-actions/editor-context";
import style from "./problem-count.module.css";

export function ProblemCount({ problems }: { problems: Problems | undefined }) {
  const { setPanel } = useEditorContext();
  const count = problems?.problems.length ?? 0;
  if (count === 0) return null;
  const errors = problems?.problems.filter((problem) => problem.severity === "error").length ?? 0;
  return (
    <button
      type="button"
      className={style.word}
      data-worst={errors > 0 ? "error" : "warning"}
      onClick={() => setPanel("problems")}
      title={
        errors > 0 ? `${errors} keep the graph from starting` : "Nothing keeps it from starting"
      }
    >
      <IconAlertTriangle size={13} aria-hidden />
      {count}
      <span>{count === 1 ? "problem" : "problems"}</span>
    </button>
  );
}
