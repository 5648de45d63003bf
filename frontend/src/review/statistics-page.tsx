/** Many runs of one graph: how often it succeeds, where the time goes, what fails, what never ran. */
import { Select, Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconChartBar } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { useGraphNames } from "../api/graph-names";
import { errorText } from "../api/http";
import { type ActionStatistics, type Statistics, useStatistics } from "../api/review";
import type { DurationBounds, Run } from "../api/runs";
import { spokenName } from "../graph/spoken-name";
import { boundsText } from "../status/durations";
import { INTO } from "../status/level-places";
import { runLabel } from "../status/progress";
import { useSiteChoice } from "../status/site-choice";
import { toneColor } from "../status/state-label";
import { Empty } from "../ui/empty";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import type { RunBarParts } from "./run-page";
import style from "./statistics-page.module.css";

const seconds = (took: DurationBounds | null) => boundsText(took) ?? "—";
const high = (took: DurationBounds | null) => took?.most ?? took?.least ?? 0;

/** One bar per run, the oldest on the left; its height is how long it took. */
function RunBars({ runs }: { runs: Statistics["runs"] }) {
  const longest = Math.max(0.001, ...runs.map((run) => high(run.span)));
  const ordered = [...runs].reverse();
  return (
    <ol className={style.bars} aria-label="Runs, the oldest first">
      {ordered.map((run) => {
        const { tone, word } = runLabel(run as unknown as Run);
        const text = `Run ${run.number}: ${word}, ${seconds(run.span)}`;
        return (
          <li key={run.id}>
            <Link to={`/runs/${run.id}`} title={text} aria-label={text}>
              <i
                data-unknown={run.span?.most == null || undefined}
                style={{
                  height: `${Math.max(8, (run.span?.most == null ? 1 : high(run.span) / longest) * 100)}%`,
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

type ResultName = "true" | "false" | "error" | "stopped" | "unknown";

interface ResultPart {
  readonly result: ResultName;
  readonly count: number;
  /** Persons gave these results by word; no answer has shown them. */
  readonly said: boolean;
}

/** Return the visits of an action by result: those seen, those that persons said, and the rest. */
export function resultParts(action: ActionStatistics): ResultPart[] {
  const partsOf = (counts: Record<string, number>, said: boolean) =>
    Object.entries(counts).map(([name, count]) => ({ result: name as ResultName, count, said }));
  const rest = { result: "unknown", count: action.unknown, said: false } as const;
  const all = [...partsOf(action.results, false), ...partsOf(action.said ?? {}, true), rest];
  return all.filter(({ count }) => count > 0);
}

const partWords = ({ result, count, said }: ResultPart): string =>
  `${count} ${result}${said ? " by word" : ""}`;

function ResultBar({ action }: { action: ActionStatistics }) {
  const parts = resultParts(action);
  const text = parts.map(partWords).join(", ") || "never ran";
  const said = parts.filter((part) => part.said);
  return (
    <>
      <span className={style.results} role="img" aria-label={text} title={text}>
        {parts.map(({ result, count, said }) => (
          <i
            key={`${result} ${said}`}
            data-tone={result}
            data-said={said || undefined}
            style={{ flexGrow: count, color: toneColor[result] }}
          />
        ))}
      </span>
      {said.length > 0 && (
        <span className="quiet-xs" aria-hidden>
          {said.map(partWords).join(", ")}
        </span>
      )}
    </>
  );
}

/**
 * Shows the range of the median as a bar, up to the 90th percentile as a line, and the longest as a
 * tick.
 */
function SpreadBar({ action, most }: { action: ActionStatistics; most: number }) {
  const { p50, p90, longest } = action.spans;
  const share = (s: number) => `${Math.min(100, (s / most) * 100)}%`;
  if (p50 === null) return <span className="m-0 faint-12">no end was seen</span>;
  return (
    <span className={style.spread} aria-hidden>
      <i
        className={style.range}
        style={{ left: share(p50.least), right: `calc(100% - ${share(high(p90))})` }}
      />
      <i className={style.longest} style={{ left: share(high(longest)) }} />
      <i
        className={style.median}
        style={{ left: share(p50.least), width: `max(3px, ${share(high(p50) - p50.least)})` }}
      />
    </span>
  );
}

/** Names the actions around an action, outermost first, and then the action. */
function ActionWay({ action: { levels, name } }: { action: ActionStatistics }) {
  return (
    <bdi>
      {levels.length > 0 && (
        <span className="ink3 weight-400">{[...levels.map(spokenName), ""].join(INTO)}</span>
      )}
      {spokenName(name)}
    </bdi>
  );
}

function Actions({ actions }: { actions: readonly ActionStatistics[] }) {
  const most = Math.max(0.001, ...actions.map((action) => high(action.spans.longest)));
  const weight = (action: ActionStatistics) => high(action.spans.p50) * action.visits;
  const slowest = [...actions].sort((a, b) => weight(b) - weight(a));
  return (
    <div className="scroll-x">
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
              <th scope="row">
                <ActionWay action={action} />
              </th>
              <td className={style.number} data-column="Visits">
                {visitCount(action)}
              </td>
              <td className={style.wide}>
                <ResultBar action={action} />
              </td>
              <td className={style.spreads}>
                <SpreadBar action={action} most={most} />
              </td>
              <td className={style.number} data-column="Median">
                {seconds(action.spans.p50)}
              </td>
              <td className={style.number} data-column="90 %">
                {seconds(action.spans.p90)}
              </td>
              <td className={style.number} data-column="Longest">
                {seconds(action.spans.longest)}
              </td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}

/** Robots are not seen at every moment, so that visits may have been missed. */
function visitCount({ visits, at_least }: ActionStatistics): string {
  return at_least ? `at least ${visits}` : String(visits);
}

const failedOf = (counts: Record<string, number> | undefined): number =>
  (counts?.error ?? 0) + (counts?.false ?? 0);

/** Failures that were seen, and those that persons gave by word. */
function failures(action: ActionStatistics): number {
  return failedOf(action.results) + failedOf(action.said);
}

/** Return how many visits of an action failed, in words: those by word are told apart. */
export function failureWords(action: ActionStatistics): string {
  const said = failedOf(action.said);
  const words = `${failures(action)} of ${visitCount(action)} visits`;
  return said === 0 ? words : `${words}, ${said} of these by word`;
}

function Found({ found }: { found: Statistics }) {
  const rate = found.judged === 0 ? null : Math.round((found.succeeded / found.judged) * 100);
  const hidden = found.actions.reduce((sum, action) => sum + action.unknown, 0);
  const failing = found.actions
    .filter((action) => failures(action) > 0)
    .sort((a, b) => failures(b) / b.visits - failures(a) / a.visits)
    .slice(0, 5);
  return (
    <div className={style.inner}>
      <div className={style.cards}>
        <section className={style.card}>
          <h2>Success</h2>
          <p className={style.big}>{rate === null ? "—" : `${rate} %`}</p>
          <p className="m-0 faint-12">
            {found.judged > 0 && `${found.succeeded} of ${found.judged} runs finished true. `}
            {found.unknown > 0 &&
              `${found.unknown} finished with an unknown result, since robots do not report it; they are not counted. `}
            Stopped, refused and lost ones say nothing about the graph and are not counted.
          </p>
        </section>
        <section className={style.card}>
          <h2>Most failing</h2>
          {failing.length === 0 ? (
            <p className="m-0 faint-12">
              {hidden > 0
                ? `No action is known to have ended false or in error; the result of ${hidden} visits is not known.`
                : "No action ended false or in error."}
            </p>
          ) : (
            <ul className={style.list}>
              {failing.map((action) => (
                <li key={action.action}>
                  <b>
                    <ActionWay action={action} />
                  </b>{" "}
                  {failureWords(action)}
                </li>
              ))}
            </ul>
          )}
        </section>
        <section className={style.card}>
          <h2>Arrows never taken</h2>
          {found.never_taken.length === 0 ? (
            <p className="m-0 faint-12">
              {found.untold > 0
                ? "None is known."
                : "Every arrow of the newest version whose action ran was taken."}
            </p>
          ) : (
            <ul className={style.list}>
              {found.never_taken.slice(0, 6).map((arrow) => (
                <li key={`${arrow.parent} ${arrow.child}`}>
                  {isolated(arrow.parent)} → {isolated(arrow.child)}{" "}
                  <span className="m-0 faint-12">on {arrow.outcomes.join(", ")}</span>
                </li>
              ))}
              {found.never_taken.length > 6 && (
                <li className="m-0 faint-12">and {found.never_taken.length - 6} more</li>
              )}
            </ul>
          )}
          {found.untold > 0 && (
            <p className="m-0 faint-12">
              Of {counted(found.untold, "arrow")} it is not known whether it was ever taken: robots
              do not report results.
            </p>
          )}
        </section>
      </div>
      <section className={style.card}>
        <h2>The newest {found.runs.length} runs</h2>
        <RunBars runs={found.runs} />
      </section>
      <section className={style.card}>
        <h2>Where the time goes</h2>
        <Actions actions={found.actions} />
      </section>
    </div>
  );
}

/** Names the graph whose runs are counted, and lets a person choose another one. */
function GraphChoice({ graph }: { graph: string }) {
  const [, go] = useLocation();
  const names = useGraphNames();
  const known = (names.data ?? []).map(({ id, name }) => ({ value: id, label: name }));
  const strange = names.isSuccess ? "A graph that is not in the list" : "…";
  const isKnown = graph === "" || known.some(({ value }) => value === graph);
  return (
    <Select
      aria-label="Graph"
      error={names.isError && errorText(names.error)}
      placeholder={names.data?.length === 0 ? "No graph yet" : "Choose a graph"}
      data={isKnown ? known : [...known, { value: graph, label: strange }]}
      searchable
      allowDeselect={false}
      maw="22rem"
      w="100%"
      value={graph || null}
      onChange={(id) => id && go(`/runs/statistics?${new URLSearchParams({ graph: id })}`)}
    />
  );
}

export function StatisticsPage({ bar }: { bar: (parts: RunBarParts) => ReactNode }) {
  const graph = new URLSearchParams(useSearch()).get("graph") ?? "";
  const { runner, choice } = useSiteChoice();
  const found = useStatistics(runner, graph);
  return (
    <>
      {bar({ crumbs: [{ label: "Runs", to: "/runs" }, { label: "Statistics" }] })}
      <main className="page">
        {graph === "" ? (
          <Empty
            icon={<IconChartBar size={22} />}
            title="Of which graph?"
            action={<GraphChoice graph="" />}
          >
            How often its runs succeed, where their time goes, and which action fails.
          </Empty>
        ) : (
          <div className={style.head}>
            <GraphChoice graph={graph} />
            {choice}
          </div>
        )}
        {found.isLoading && (
          <div className={style.inner} aria-busy="true">
            <Skeleton height={110} mb={12} />
            <Skeleton height={280} />
          </div>
        )}
        {found.isError && (
          <Empty icon={<IconAlertTriangle size={22} />} title="There are no figures">
            {errorText(found.error)}
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
