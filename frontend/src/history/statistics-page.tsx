/** Many runs of one graph: how often it succeeds, where the time goes, what fails, what never ran. */
import { Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconChartBar } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { Link, useSearch } from "wouter";
import { sentence } from "../api/http";
import { runWord } from "../api/progress";
import { type ActionStatistics, type Statistics, useStatistics } from "../api/review";
import type { Run } from "../api/runs";
import { useLive } from "../api/use-live";
import { Empty } from "../ui/empty";
import { toneColor } from "../ui/state-word";
import { duration } from "../ui/when";
import type { BarParts } from "./run-page";
import style from "./statistics-page.module.css";

const seconds = (s: number | null) => (s === null ? "—" : duration(s * 1000));

/** One bar per run, the oldest on the left; its height is how long it took. */
function RunBars({ runs }: { runs: Statistics["runs"] }) {
  const longest = Math.max(0.001, ...runs.map((run) => run.took ?? 0));
  const ordered = [...runs].reverse();
  return (
    <ol className={style.bars} aria-label="Runs, the oldest first">
      {ordered.map((run) => {
        const { tone, word } = runWord(run as unknown as Run);
        const text = `Run ${run.number}: ${word}, ${seconds(run.took)}`;
        return (
          <li key={run.id}>
            <Link to={`/runs/${run.id}`} title={text} aria-label={text}>
              <i
                data-unknown={run.took === null || undefined}
                style={{
                  height: `${Math.max(8, ((run.took ?? longest) / longest) * 100)}%`,
                  color: toneColor[tone],
                }}
              />
            </Link>
          </li>
        );
      })}
    </ol>
  );
}

function ResultBar({ action }: { action: ActionStatistics }) {
  const known = Object.entries(action.results) as [
    "true" | "false" | "error" | "stopped",
    number,
  ][];
  const counted = known.reduce((sum, [, count]) => sum + count, 0);
  const unknown = Math.max(0, action.visits - counted);
  const parts = [...known, ...(unknown > 0 ? ([["unknown", unknown]] as const) : [])];
  const text = parts.map(([name, count]) => `${count} ${name}`).join(", ");
  return (
    <span className={style.results} role="img" aria-label={text} title={text}>
      {parts.map(([name, count]) => (
        <i key={name} data-tone={name} style={{ flexGrow: count, color: toneColor[name] }} />
      ))}
    </span>
  );
}

/** Median as a dot, from there to the 90th percentile as a bar, the longest as a tick. */
function SpreadBar({ action, most }: { action: ActionStatistics; most: number }) {
  const share = (s: number | null) => `${((s ?? 0) / most) * 100}%`;
  if (action.p50 === null) return <span className={style.quiet}>no end was seen</span>;
  return (
    <span className={style.spread} aria-hidden>
      <i
        className={style.range}
        style={{ left: share(action.p50), right: `calc(100% - ${share(action.p90)})` }}
      />
      <i className={style.longest} style={{ left: share(action.longest) }} />
      <i className={style.median} style={{ left: share(action.p50) }} />
    </span>
  );
}

function Actions({ actions }: { actions: readonly ActionStatistics[] }) {
  const most = Math.max(0.001, ...actions.map((action) => action.longest ?? 0));
  const slowest = [...actions].sort((a, b) => (b.p50 ?? 0) * b.visits - (a.p50 ?? 0) * a.visits);
  return (
    <div className={style.scroll}>
      <table className={style.table}>
        <thead>
          <tr>
            <th>Action</th>
            <th className={style.number}>Visits</th>
            <th>Results</th>
            <th>Time</th>
            <th className={style.number}>Median</th>
            <th className={style.number}>90 %</th>
            <th className={style.number}>Longest</th>
          </tr>
        </thead>
        <tbody>
          {slowest.map((action) => (
            <tr key={action.action}>
              <th scope="row">{action.action}</th>
              <td className={style.number}>{action.visits}</td>
              <td>
                <ResultBar action={action} />
              </td>
              <td className={style.wide}>
                <SpreadBar action={action} most={most} />
              </td>
              <td className={style.number}>{seconds(action.p50)}</td>
              <td className={style.number}>{seconds(action.p90)}</td>
              <td className={style.number}>{seconds(action.longest)}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

function failures(action: ActionStatistics): number {
  return (action.results.error ?? 0) + (action.results.false ?? 0);
}

function Found({ found }: { found: Statistics }) {
  const rate = found.judged === 0 ? null : Math.round((found.succeeded / found.judged) * 100);
  const failing = found.actions
    .filter((action) => failures(action) > 0)
    .sort((a, b) => failures(b) / b.visits - failures(a) / a.visits)
    .slice(0, 5);
  return (
    <div className={style.inner}>
      <div className={style.cards}>
        <section className={style.card}>
          <h3>Success</h3>
          <p className={style.big}>{rate === null ? "—" : `${rate} %`}</p>
          <p className={style.quiet}>
            {found.succeeded} of {found.judged} runs finished true. Stopped, refused and lost ones
            say nothing about the graph and are not counted.
          </p>
        </section>
        <section className={style.card}>
          <h3>Most failing</h3>
          {failing.length === 0 ? (
            <p className={style.quiet}>No action ended false or in error.</p>
          ) : (
            <ul className={style.list}>
              {failing.map((action) => (
                <li key={action.action}>
                  <b>{action.action}</b> {failures(action)} of {action.visits} visits
                </li>
              ))}
            </ul>
          )}
        </section>
        <section className={style.card}>
          <h3>Arrows never taken</h3>
          {found.never_taken.length === 0 ? (
            <p className={style.quiet}>Every arrow of the newest version was taken.</p>
          ) : (
            <ul className={style.list}>
              {found.never_taken.slice(0, 6).map((arrow) => (
                <li key={`${arrow.parent} ${arrow.child}`}>
                  {arrow.parent} → {arrow.child}{" "}
                  <span className={style.quiet}>on {arrow.outcomes.join(", ")}</span>
                </li>
              ))}
              {found.never_taken.length > 6 && (
                <li className={style.quiet}>and {found.never_taken.length - 6} more</li>
              )}
            </ul>
          )}
        </section>
      </div>
      <section className={style.card}>
        <h3>The newest {found.runs.length} runs</h3>
        <RunBars runs={found.runs} />
      </section>
      <section className={style.card}>
        <h3>Where the time goes</h3>
        <Actions actions={found.actions} />
      </section>
    </div>
  );
}

export function StatisticsPage({ bar }: { bar: (parts: BarParts) => ReactNode }) {
  const graph = new URLSearchParams(useSearch()).get("graph") ?? "";
  const { runner } = useLive();
  const found = useStatistics(runner, graph);
  return (
    <>
      {bar({ crumbs: [{ label: "Runs", to: "/runs" }, { label: "Statistics" }] })}
      <main className={style.page}>
        {found.isLoading && (
          <div className={style.inner} aria-busy="true">
            <Skeleton height={110} mb={12} />
            <Skeleton height={280} />
          </div>
        )}
        {found.isError && (
          <Empty icon={<IconAlertTriangle size={22} />} title="There are no figures">
            {sentence(found.error)}
          </Empty>
        )}
        {found.data?.runs.length === 0 && (
          <Empty icon={<IconChartBar size={22} />} title="No run of this graph is over yet">
            Figures appear here with the first run that ends.
          </Empty>
        )}
        {found.data && found.data.runs.length > 0 && <Found found={found.data} />}
      </main>
    </>
  );
}
