/** Whether what runs is what is on screen, in words. */
import { useQuery } from "@tanstack/react-query";
import { useMemo } from "react";
import { keys, type Version } from "../api/graphs";
import { ask } from "../api/http";
import type { Run } from "../api/runs";
import type { Graph } from "../graph/model";
import { fromUmrf } from "../ui/canvas/from-umrf";
import { meaning } from "../ui/canvas/meaning";
import style from "./draft-word.module.css";

interface Props {
  run: Run | null;
  label: string;
  graph: Graph;
  seq: number;
}

export function DraftWord({ run, label, graph, seq }: Props) {
  const goes = run !== null && run.ended_at === null;
  const version = useQuery({
    queryKey: keys.version(run?.version ?? ""),
    queryFn: ({ signal }) =>
      ask<Version>(`/api/versions/${encodeURIComponent(run?.version ?? "")}`, { signal }),
    enabled: goes && run.version !== null,
    staleTime: Number.POSITIVE_INFINITY,
  }).data;
  const running = useMemo(() => (version ? meaning(fromUmrf(version.umrf)) : null), [version]);
  const differs = useMemo(
    () => goes && version?.seq !== seq && running !== null && running !== meaning(graph),
    [goes, version, seq, running, graph],
  );
  if (!goes) return null;
  return (
    <span className={style.word} data-differs={differs || undefined}>
      {differs ? "Draft differs from running" : "Running"} <i>{label}</i>
    </span>
  );
}
