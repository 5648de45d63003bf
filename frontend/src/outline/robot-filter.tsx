/** The robots of a graph: what each is called, its colour, and highlighting the actions of one. */
import { memo, useMemo } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import { colorOfName } from "../ui/name-colors";
import { useWatched } from "../ui/watched";
import style from "./robot-filter.module.css";

/** Returns the number of actions of each robot, by name; those for any robot come last. */
function robotCounts(actors: readonly string[]): [name: string, actions: number][] {
  const counts = new Map<string, number>();
  for (const actor of actors) counts.set(actor, (counts.get(actor) ?? 0) + 1);
  return [...counts].sort(([a], [b]) => (a === "" ? 1 : b === "" ? -1 : a.localeCompare(b)));
}

/** Buttons that highlight the actions of one robot; not drawn where there is only one robot. */
export const RobotFilter = memo(function Robots() {
  const { graph, store } = useEditorContext();
  const robots = useMemo(
    () => robotCounts(graph.actions.map(({ actor }) => actor)),
    [graph.actions],
  );
  const lit = useWatched(store.robot);
  if (robots.length < 2 && lit === null) return null;
  return (
    <fieldset className={style.robots}>
      <legend className="visually-hidden">Show the actions of one robot</legend>
      {robots.map(([name, actions]) => (
        <button
          key={name}
          type="button"
          className={style.robot}
          aria-pressed={lit === name}
          data-dim={(lit !== null && lit !== name) || undefined}
          onClick={() => store.robot.set(lit === name ? null : name)}
        >
          <i style={{ background: colorOfName(name) }} aria-hidden />
          <span>{name || "any robot"}</span>
          <span className={style.count}>
            {actions}
            <span className="visually-hidden"> {actions === 1 ? "action" : "actions"}</span>
          </span>
        </button>
      ))}
    </fieldset>
  );
});
