/** Graphs as rows: name, last run in words, problems. */

import { Skeleton } from "@mantine/core";
import { Link } from "wouter";
import type { GraphSummary } from "../api/graphs";
import { newestRun } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useCurrentName } from "../api/people";
import { shiftOfRun } from "../api/site-places";
import { runEndText, runStatus, type Tone } from "../status/progress";
import { toneColor } from "../status/state-label";
import { ago, instant, stopwatch, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { GraphCounts } from "./graph-counts";
import style from "./sidebar.module.css";

function subtitle(graph: GraphSummary, words: string | null, now: number): string {
  if (words !== null) return words;
  const parts: string[] = [];
  if (graph.actions !== undefined) {
    parts.push(counted(graph.actions, "action"));
  }
  if (graph.drafts) parts.push(counted(graph.drafts, "draft"));
  const at = instant(graph.updated_at);
  if (at !== null) parts.push(ago(at, now));
  return parts.join(" · ");
}

export function GraphRow({ graph, current }: { graph: GraphSummary; current: boolean }) {
  const { now: live } = useLive();
  const run = newestRun(live, graph.id);
  const by = useCurrentName(run?.author);
  const goes = run !== null && run.ended_at === null;
  const now = useNow(goes ? 1000 : 20_000);
  let tone: Tone = "idle";
  let words: string | null = null;
  if (run) {
    const status = runStatus(run, live);
    tone = status.tone;
    const start = instant(run.started_at) ?? now;
    const end = instant(run.ended_at) ?? now;
    const present = now - shiftOfRun(run.id);
    const took = live.link === "down" ? "" : ` · ${stopwatch(present - start)}`;
    words = goes ? `${by} · ${status.word}${took}` : `${runEndText(run)} · ${ago(end, present)}`;
  }
  return (
    <Link
      to={`/graphs/${graph.id}`}
      className={style.row}
      aria-current={current ? "page" : undefined}
      data-current={current || undefined}
    >
      <i className={style.dot} style={{ background: toneColor[tone] }} aria-hidden />
      <span className="fill">
        <span className={style.name}>{graph.name || "Untitled"}</span>
        <span className={style.sub}>{subtitle(graph, words, now)}</span>
      </span>
      <GraphCounts graph={graph} brief />
    </Link>
  );
}

export function RowSkeletons({ count }: { count: number }) {
  return (
    <div aria-hidden>
      {Array.from({ length: count }, (_, i) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: they are all alike
        <div className={style.row} key={i}>
          <Skeleton circle height={8} />
          <span className="fill">
            <Skeleton height={10} width="62%" mb={6} />
            <Skeleton height={8} width="84%" />
          </span>
        </div>
      ))}
    </div>
  );
}
