/** The robots of a graph: what each is called, its colour, and highlighting the actions of one. */
import { memo, useMemo } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import { robotCounts } from "../graph/robots";
import { colorOfName } from "../ui/name-colors";
import { useWatched } from "../ui/watched";
import style from "./robot-filter.module.css";

/** Buttons that highlight the actions of one robot; not drawn where there is only one robot. */
export const RobotFilter = memo(function Robots() {
  const { graph, store } = useEditorContext();
  const robots = useMemo(() => robotCounts(graph.actions), [graph.actions]);
  const lit = useWatched(store.robot);
  if (robots.length < 2 && lit === null) return null;
  return (
    <fieldset className="fieldset-reset wrap gap-6px">
      <legend className="visually-hidden">Show the actions of one robot</legend>
      {robots.map(([name, actions]) => (
        <button
          key={name}
          type="button"
          className={`${style.robot} finger`}
          aria-pressed={lit === name}
          data-dim={(lit !== null && lit !== name) || undefined}
          onClick={() => store.robot.set(lit === name ? null : name)}
        >
          <i style={{ background: colorOfName(name) }} aria-hidden />
          <span>{name || "any robot"}</span>
          <span className="ink2 tabular">
            {actions}
            <span className="visually-hidden"> {actions === 1 ? "action" : "actions"}</span>
          </span>
        </button>
      ))}
    </fieldset>
  );
});
