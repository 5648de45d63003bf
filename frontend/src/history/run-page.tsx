/** One run: its version on the canvas, every visit on the timeline, what was said, how it ended. */
import { Button, Skeleton, Tabs } from "@mantine/core";
import { IconAlertTriangle } from "@tabler/icons-react";
import { ReactFlowProvider } from "@xyflow/react";
import { type ReactNode, useMemo, useState } from "react";
import { Link } from "wouter";
import { authorName } from "../api/graphs";
import { sentence } from "../api/http";
import { endWords, progressByAid, runWord } from "../api/progress";
import { type Run, useRun } from "../api/runs";
import { useLive } from "../api/use-live";
import { fromUmrf } from "../ui/canvas/from-umrf";
import { GraphView } from "../ui/canvas/view";
import { Empty } from "../ui/empty";
import { lanesOf } from "../ui/lanes";
import { StateWord } from "../ui/state-word";
import { Timeline } from "../ui/timeline";
import type { Crumb } from "../ui/top-bar";
import { clock, instant, useNow } from "../ui/when";
import { Events } from "./events";
import { Facts } from "./facts";
import style from "./run-page.module.css";
import { useVersionLabel } from "./version-label";

export interface BarParts {
  crumbs: readonly Crumb[];
  status?: ReactNode;
  actions?: ReactNode;
}

interface Props {
  id: string;
  bar: (parts: BarParts) => ReactNode;
}

function Shown({ run, bar }: { run: Run; bar: Props["bar"] }) {
  const { now: live } = useLive();
  const [selected, setSelected] = useState<string | null>(null);
  const graph = useMemo(() => fromUmrf(run.umrf), [run.umrf]);
  const goes = run.ended_at === null;
  const unsure = goes && live.link === "down";
  const present = useNow(250, goes);
  const progress = useMemo(() => progressByAid(run, unsure), [run, unsure]);
  const lanes = useMemo(() => lanesOf(run, graph), [run, graph]);
  const picked = useMemo(() => new Set(selected === null ? [] : [selected]), [selected]);
  const label = useVersionLabel(run);
  const { tone, word } = runWord(run);
  const since = `unknown since ${clock(live.since)}`;
  return (
    <>
      {bar({
        crumbs: [
          { label: "Runs", to: "/runs" },
          { label: run.graph_name, ...(run.graph === null ? {} : { to: `/graphs/${run.graph}` }) },
          { label: `Run ${run.number}` },
        ],
        status: (
          <>
            <StateWord
              pill
              tone={unsure ? "unknown" : tone}
              word={unsure ? since : goes ? word : endWords(run)}
            />
            {run.simulated && <span className={style.simulated}>simulated</span>}
          </>
        ),
        actions: run.graph !== null && (
          <Button component={Link} to={`/graphs/${run.graph}`} className={style.back ?? ""}>
            Open graph
          </Button>
        ),
      })}
      <main className={style.page}>
        <section className={style.canvas} aria-label="Graph of the run">
          <ReactFlowProvider>
            <GraphView
              graph={graph}
              progress={progress}
              selected={picked}
              onSelect={setSelected}
              label={`Version ${label} of ${run.graph_name}`}
            />
          </ReactFlowProvider>
        </section>
        <section className={style.strip} aria-label="Timeline">
          <Timeline
            run={run}
            lanes={lanes}
            until={unsure ? live.since : (instant(run.ended_at) ?? present)}
            unsure={unsure}
            selected={selected}
            onPick={setSelected}
          />
        </section>
        <aside className={style.side} aria-label="About the run">
          <Tabs defaultValue="events" className={style.tabs ?? ""}>
            <Tabs.List>
              <Tabs.Tab value="events">Events</Tabs.Tab>
              <Tabs.Tab value="facts">Facts</Tabs.Tab>
            </Tabs.List>
            <Tabs.Panel value="events" className={style.panel ?? ""}>
              <Events run={run} version={label} selected={selected} onPick={setSelected} />
            </Tabs.Panel>
            <Tabs.Panel value="facts" className={style.panel ?? ""}>
              <Facts run={run} version={label} by={authorName(run.author)} />
            </Tabs.Panel>
          </Tabs>
        </aside>
      </main>
    </>
  );
}

export function RunPage({ id, bar }: Props) {
  const { runner, now } = useLive();
  const stored = useRun(runner, id);
  const live = now.runs.get(id);
  const run = useMemo(() => {
    if (!stored.data) return null;
    return live ? { ...stored.data, ...live, umrf: stored.data.umrf } : stored.data;
  }, [stored.data, live]);
  if (run !== null) return <Shown run={run} bar={bar} />;
  const crumbs = [{ label: "Runs", to: "/runs" }, { label: "Run" }];
  return (
    <>
      {bar({ crumbs })}
      <main className={style.page}>
        {stored.isError ? (
          <Empty icon={<IconAlertTriangle size={22} />} title="This run cannot be shown">
            {sentence(stored.error)}
          </Empty>
        ) : (
          <section className={style.canvas} aria-busy="true">
            <Skeleton height="100%" radius={0} />
          </section>
        )}
      </main>
    </>
  );
}
