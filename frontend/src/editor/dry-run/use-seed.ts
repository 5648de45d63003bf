/** Loads the moment of a run from which a dry-run shall start. */
import { notifications } from "@mantine/notifications";
import { useEffect, useRef, useState } from "react";
import { errorText } from "../../api/http";
import { useRun } from "../../api/runs";
import type { DryRunSeed } from "../../dry-run/seed";
import type { Graph } from "../../graph/model";
import type { seedOfMoment } from "./record-reader";

/** A run, and the time `t` in ms after its start. */
interface Asked {
  run: string;
  t: number;
}

/** Loads the module that reads records, when a moment is asked for. */
function useRecordReader(asked: boolean): typeof seedOfMoment | null {
  const [loaded, setLoaded] = useState<{ seedOfMoment: typeof seedOfMoment } | null>(null);
  useEffect(() => {
    if (!asked) return;
    import("./record-reader").then(setLoaded, (error: Error) => {
      const message = errorText(error);
      notifications.show({
        color: "red",
        title: "The dry-run cannot begin at that moment",
        message,
      });
    });
  }, [asked]);
  return loaded?.seedOfMoment ?? null;
}

/**
 * Return the state at the asked moment; null until it is there. It is computed once for each
 * moment, with the graph as it was when the record arrived.
 */
export function useSeed(
  runner: string | undefined,
  asked: Asked | null,
  graph: Graph,
  begun: boolean,
): DryRunSeed | null {
  const run = useRun(asked === null ? undefined : runner, asked?.run ?? "").data;
  const read = useRecordReader(asked !== null);
  const made = useRef<{ asked: Asked; seed: DryRunSeed } | null>(null);
  if (asked === null || run === undefined || !begun || read === null) return null;
  const { current } = made;
  if (current?.asked.run === asked.run && current.asked.t === asked.t) return current.seed;
  const seed = read(run, graph, asked.t);
  made.current = { asked, seed };
  return seed;
}
