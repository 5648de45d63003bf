/** On which level of a run one is: the way out, the way further in, and to the graph as it is now. */
import { IconExternalLink, IconStairsDown } from "@tabler/icons-react";
import { useMemo, useState } from "react";
import { Link } from "wouter";
import type { Run } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import { addressInside, type Level, levelsOf } from "../canvas/level-path";
import { fullName, type Graph, type Key } from "../graph/model";
import { spokenName } from "../graph/spoken-name";
import { factOf, placesOf } from "../status/level-places";
import type { GraphInRun } from "../status/progress-inside";
import { announcer } from "../ui/announcer";
import { useStableCallback } from "../ui/hooks";
import style from "./levels.module.css";

/** The address of the graph that is shown, entered in the editor by the same way; null where the server has
 * not all graphs on it. */
function editorAddress({ way, graphs }: LevelCursor): string | null {
  const id = graphs.at(-1)?.id ?? null;
  if (way.length === 0 || id === null || graphs.some((each) => each.id === null)) return null;
  return addressInside("", way, id);
}

function Crumbs({ level, name }: { level: LevelCursor; name: string }) {
  const { levels, graphs, enter } = level;
  const words = [name, ...levels.map(spokenName)];
  return (
    <nav aria-label="Levels">
      <ol className={style.way}>
        {words.map((each, depth) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: a level is its depth
          <li className="row min-w-0" key={depth}>
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
          <IconStairsDown size={14} aria-hidden /> Inside <bdi>{spokenName(fullName(chosen))}</bdi>
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

export interface LevelCursor {
  sent: SentLevels;
  /** The actions that one is inside of, outermost first. */
  levels: readonly string[];
  /** All graphs on the way, the outermost first. */
  graphs: readonly SentLevel[];
  /** The graph that is shown. */
  graph: Graph;
  /** Position of the graph in the run; null for the outermost graph. */
  inside: GraphInRun | null;
  /** The chosen action of that graph; and as the run calls it. */
  key: Key | null;
  fact: string | null;
  /** The way as addresses have it. */
  way: readonly Level[];
  select: (key: Key | null) => void;
  enter: (levels: readonly string[], key: Key | null) => void;
  /** Chooses an action as the run calls it, on its level; where that was not sent along, the outermost
   * action that it is inside of. */
  pick: (fact: string | null) => void;
}

interface Spot {
  levels: readonly string[];
  key: Key | null;
}

export function useLevel(run: Run, search: string): LevelCursor {
  const { umrf, subgraphs } = run;
  // biome-ignore lint/correctness/useExhaustiveDependencies: what was sent does not change while a run goes on
  const sent = useMemo(() => sentLevels(run), [umrf, subgraphs]);
  const [{ levels, key }, setSpot] = useState<Spot>(() => ({
    levels: levelsAsked(sent, search),
    key: new URLSearchParams(search).get("action"),
  }));
  const enter = useStableCallback((to: readonly string[], chosen: Key | null) => {
    const words = to.length === 0 ? run.graph_name : (to.at(-1) ?? "");
    if (to.join("\n") !== levels.join("\n")) announcer.say(`Inside ${words}`);
    setSpot({ levels: to, key: chosen });
  });
  const pick = useStableCallback((fact: string | null) => {
    const place = fact === null ? undefined : placesOf(run).get(fact);
    if (place === undefined) return setSpot({ levels, key: null });
    const there = graphsOn(sent, place.levels)?.at(-1);
    if (there !== undefined) return enter(place.levels, keyAt(there.graph, place.name));
    return enter([], keyAt(sent.top.graph, place.levels[0] ?? place.name));
  });
  const select = useStableCallback((chosen: Key | null) => setSpot({ levels, key: chosen }));
  return useMemo(() => {
    const graphs = graphsOn(sent, levels) ?? [sent.top];
    const { graph } = graphs.at(-1) ?? sent.top;
    const action = graph.actions.find((each) => each.key === key);
    return {
      ...{ sent, levels, graphs, graph, key, select, enter, pick },
      inside: levels.length === 0 ? null : { graph, levels },
      fact: action === undefined ? null : factOf(run.graph_name, [...levels, fullName(action)]),
      way: addressed(sent, levels),
    };
  }, [sent, levels, key, run.graph_name, select, enter, pick]);
}

export interface SentLevel {
  readonly graph: Graph;
  /** Id of the graph that this is a version of. */
  readonly id: string | null;
}

/** A graph with those inside of it, by value. */
export interface SentLevels {
  readonly top: SentLevel;
  /** By the name of the actions that stand for it. */
  readonly inside: (name: string) => SentLevel | null;
}

/** Return the graphs that were sent with a run; each one is parsed once, when it is asked for. */
export function sentLevels({ umrf, graph: id, subgraphs = [] }: Run): SentLevels {
  const sent = new Map(subgraphs.map((each) => [each.name, each]));
  const known = new Map<string, SentLevel>();
  const inside = (name: string) => {
    const before = known.get(name);
    const found = sent.get(name);
    if (before !== undefined || found === undefined) return before ?? null;
    const read = { graph: fromUmrf(found.umrf), id: found.graph };
    known.set(name, read);
    return read;
  };
  return { top: { graph: fromUmrf(umrf), id }, inside };
}

/** All graphs on a way, the outermost first; null where one of them was not sent along. */
export function graphsOn(sent: SentLevels, levels: readonly string[]): SentLevel[] | null {
  const found = [sent.top];
  for (const level of levels) {
    const action = found.at(-1)?.graph.actions.find((each) => fullName(each) === level);
    const inside = action === undefined ? null : sent.inside(action.name);
    if (inside === null) return null;
    found.push(inside);
  }
  return found;
}

/** The key of an action on its level. */
function keyAt(graph: Graph | undefined, name: string): Key | null {
  return graph?.actions.find((each) => fullName(each) === name)?.key ?? null;
}

const NO_ID = "run"; // in addresses: of a graph that was sent by a program, and is none of the server's

/** The way for an address; as far as it can be told in one. */
export function addressed(sent: SentLevels, levels: readonly string[]): Level[] {
  const graphs = graphsOn(sent, levels) ?? [];
  return levels.flatMap((level, depth) => {
    const around = graphs[depth];
    const action = keyAt(around?.graph, level);
    return action === null ? [] : [{ graph: around?.id ?? NO_ID, action }];
  });
}

/** The levels that an address asks for, as far down as there are such. */
export function levelsAsked(sent: SentLevels, search: string): string[] {
  const levels: string[] = [];
  for (const { action: key } of levelsOf(search)) {
    const here = graphsOn(sent, levels)?.at(-1);
    const action = here?.graph.actions.find((each) => each.key === key);
    if (action === undefined || sent.inside(action.name) === null) break;
    levels.push(fullName(action));
  }
  return levels;
}
