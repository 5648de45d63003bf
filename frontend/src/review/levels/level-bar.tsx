/** On which level of a run one is: the way out, the way further in, and to the graph as it is now. */
import { IconExternalLink, IconStairsDown } from "@tabler/icons-react";
import { Link } from "wouter";
import { addressInside } from "../../canvas/level-path";
import { fullName } from "../../graph/model";
import { spaced } from "../../status/level-words";
import style from "./level-bar.module.css";
import { keyAt } from "./sent-levels";
import type { LevelCursor } from "./use-level";

/** The address of the graph that is shown, entered in the editor by the same way; null where the server has
 * not all graphs on it. */
function editorAddress({ way, graphs }: LevelCursor): string | null {
  const id = graphs.at(-1)?.id ?? null;
  if (way.length === 0 || id === null || graphs.some((each) => each.id === null)) return null;
  return addressInside("", way, id);
}

function Crumbs({ level, name }: { level: LevelCursor; name: string }) {
  const { levels, graphs, enter } = level;
  const words = [name, ...levels.map(spaced)];
  return (
    <nav aria-label="Levels">
      <ol className={style.way}>
        {words.map((each, depth) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: a level is its depth
          <li key={depth}>
            {depth === levels.length ? (
              <b aria-current="location">
                <bdi>{each}</bdi>
              </b>
            ) : (
              <button
                type="button"
                onClick={() =>
                  enter(levels.slice(0, depth), keyAt(graphs[depth]?.graph, levels[depth] ?? ""))
                }
              >
                <bdi>{each}</bdi>
              </button>
            )}
          </li>
        ))}
      </ol>
    </nav>
  );
}

export function LevelBar({ level, name }: { level: LevelCursor; name: string }) {
  const { sent, levels, graph, key, enter } = level;
  const chosen = graph.actions.find((each) => each.key === key);
  const goesIn = chosen !== undefined && sent.inside(chosen.name) !== null;
  const editor = editorAddress(level);
  if (levels.length === 0 && !goesIn) return null;
  return (
    <div className={style.bar}>
      {levels.length > 0 && <Crumbs level={level} name={name} />}
      {goesIn && (
        <button
          type="button"
          className={style.enter}
          onClick={() => enter([...levels, fullName(chosen)], null)}
        >
          <IconStairsDown size={14} aria-hidden /> Inside <bdi>{spaced(fullName(chosen))}</bdi>
        </button>
      )}
      {editor !== null && (
        <Link to={editor} className={style.enter} title="The graph as it is now, in the editor">
          <IconExternalLink size={14} aria-hidden /> Graph
        </Link>
      )}
    </div>
  );
}
