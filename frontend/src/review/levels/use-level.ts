/** Which level of a run is shown, and which of its actions is chosen. */
import { useMemo, useState } from "react";
import type { Run } from "../../api/runs";
import type { Level } from "../../canvas/level-path";
import { fullName, type Graph, type Key } from "../../graph/model";
import { placesOf } from "../../status/level-places";
import { factOf } from "../../status/level-words";
import type { GraphInRun } from "../../status/progress-inside";
import { announcer } from "../../ui/announcer";
import { useStableCallback } from "../../ui/hooks/use-stable-callback";
import {
  addressed,
  graphsOn,
  keyAt,
  levelsAsked,
  type SentLevel,
  type SentLevels,
  sentLevels,
} from "./sent-levels";

export interface LevelCursor {
  sent: SentLevels;
  /** The actions that one is inside of, outermost first. */
  levels: readonly string[];
  /** All graphs on the way, the outermost first. */
  graphs: readonly SentLevel[];
  /** The graph that is shown. */
  graph: Graph;
  /** Where it is in the run; null: it is the outermost one. */
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
