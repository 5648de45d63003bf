/** Two runs on one canvas: what differed before they began, where they part, and why that is likely. */
import { Button, Select, Skeleton, Tabs } from "@mantine/core";
import { IconAlertTriangle, IconArrowsDiff } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useEffect, useState } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { errorText } from "../api/http";
import { engineWords } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { useCurrentName } from "../api/people";
import { type ComparedStep, type Comparison, listComparable, useComparison } from "../api/review";
import { getRun } from "../api/run-stop";
import { type Run, useRun, type Visit } from "../api/runs";
import { DifferenceView } from "../differences/difference-view";
import { boundsText, durationText } from "../status/durations";
import { wayWords } from "../status/level-places";
import { howWords, runEndText, useRunStatus, visitDuration } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { Empty } from "../ui/empty";
import { useIsPhone } from "../ui/hooks";
import { clock, day, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./compare-page.module.css";
import { ComparedCanvas, Legend } from "./compared-cards";
import {
  causeSentence,
  differenceCount,
  differencesOf,
  engineDifference,
  outermostAid,
  sameAsSeen,
  spokenOf,
  valueDifferences,
} from "./differences";
import { GhostLanes } from "./ghost-lanes";
import type { RunBarParts } from "./run-page";

function Head({ run, title }: { run: Run; title: string }) {
  const by = useCurrentName(run.author);
  const now = useNow(60_000);
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  return (
    <section className="page-card stack items-start gap-30" aria-label={title}>
      <Link to={`/runs/${run.id}`} className="ink weight-600">
        Run {run.number} · {isolated(run.graph_name)}
      </Link>
      <StateLabel pill {...useRunStatus(run)} />
      <span className={style.meta}>
        {run.simulated ? "simulator" : engineWords(run)} · {by}
        {start !== null && ` · ${day(start, now)} ${clock(start)}`}
        {end !== null && boundsText(run.took) && ` · ${boundsText(run.took)}`}
      </span>
    </section>
  );
}

function Said({ found }: { found: Comparison }) {
  const { parting } = found;
  if (parting === null) return null;
  const said = [...new Set([...parting.messages_a, ...parting.messages_b])];
  return (
    <>
      {said.map((text) => (
        <blockquote key={text} className={style.said}>
          “{text}”
        </blockquote>
      ))}
    </>
  );
}

/** Result of the comparison in one sentence, with the most likely cause of the difference. */
function Verdict({ found }: { found: Comparison }) {
  const cause = causeSentence(found);
  return (
    <section
      className={style.verdict}
      data-parts={found.parting !== null || undefined}
      data-operator={found.because?.kind.startsWith("operator_") || undefined}
    >
      <IconArrowsDiff size={18} aria-hidden />
      <div>
        <p>
          <b>{spokenOf(found, found.text)}</b>
          {cause !== null && <span> {cause}</span>}
        </p>
        <Said found={found} />
      </div>
    </section>
  );
}

function Before({ found }: { found: Comparison }) {
  const engines = engineDifference(found);
  return (
    <section>
      <h2>Before they began</h2>
      {engines !== null && (
        <p className={style.same}>{`${engines.charAt(0).toUpperCase()}${engines.slice(1)}.`}</p>
      )}
      <GraphChanges found={found} />
      <ValueChanges found={found} />
    </section>
  );
}

function WhereTheyPart({ found, onSelect }: SideProps) {
  const all = differencesOf(found);
  const same = sameAsSeen(found);
  return (
    <>
      <section>
        <h2>Where they part</h2>
        {all.length === 0 && <p className={style.same}>Nowhere, as far as was seen.</p>}
        <ol className={style.differences} aria-label="Differences">
          {all.slice(0, MOST).map(({ number, step, title, text }) => (
            <li key={number}>
              <i aria-hidden>{number}</i>
              <button type="button" onClick={() => onSelect(outermostAid(found, step))}>
                {title}
              </button>
              <p>{text}</p>
            </li>
          ))}
        </ol>
        {all.length > MOST && <p className={style.same}>and {all.length - MOST} more</p>}
      </section>
      {same.length > 0 && (
        <section>
          <h2>The same, as far as seen</h2>
          {same.slice(0, MOST).map(({ name, text }) => (
            <p key={name} className={style.same}>
              <b>{name}</b> {text}.
            </p>
          ))}
        </section>
      )}
    </>
  );
}

const MOST = 12; // of each list

interface SideProps {
  found: Comparison;
  onSelect: (aid: string | null) => void;
}

/** The differences in words, and every step in a table. */
function Side({ found, onSelect }: SideProps) {
  return (
    <aside className={style.side} aria-label="What differs">
      <Tabs defaultValue="differences" keepMounted={false} className="stack h-full">
        <Tabs.List>
          <Tabs.Tab value="differences">Differences {differenceCount(found)}</Tabs.Tab>
          <Tabs.Tab value="steps">Step by step</Tabs.Tab>
        </Tabs.List>
        <Tabs.Panel value="differences" className={style.panel ?? ""}>
          <Head run={found.b} title="This run" />
          <Head run={found.a} title="The other run" />
          <Before found={found} />
          <WhereTheyPart found={found} onSelect={onSelect} />
        </Tabs.Panel>
        <Tabs.Panel value="steps" className={style.panel ?? ""}>
          <div className="scroll-x">
            <Steps found={found} />
          </div>
          {found.left_out > 0 && (
            <p className={style.same}>{found.left_out} later steps are not listed.</p>
          )}
        </Tabs.Panel>
      </Tabs>
    </aside>
  );
}

function Found({ runner, found }: { runner: string | undefined; found: Comparison }) {
  const [selected, setSelected] = useState<string | null>(null);
  const b = useRun(runner, found.b.id).data;
  const props = { found, selected };
  return (
    <div className={style.layout}>
      <Verdict found={found} />
      <section className={style.canvas} aria-label="Both runs on the graph" data-under-stop-notice>
        {b === undefined ? (
          <Skeleton height="100%" radius={0} />
        ) : (
          <>
            <ComparedCanvas {...props} run={b} onSelect={setSelected} />
            <Legend found={found} />
          </>
        )}
      </section>
      <div className={style.strip}>
        <GhostLanes {...props} a={found.a} b={found.b} onPick={setSelected} />
      </div>
      <Side found={found} onSelect={setSelected} />
    </div>
  );
}

/**
 * Compares with the run of the same graph before this one; where there is none, or another is wanted,
 * a person chooses it.
 */
function Choose({ runner, b, asked }: { runner: string; b: string; asked: boolean }) {
  const [, go] = useLocation();
  const second = useQuery({
    queryKey: ["runs", "one", b],
    queryFn: ({ signal }) => getRun(runner, b, signal),
  });
  const graph = second.data?.graph ?? second.data?.graph_name ?? "";
  const others = useQuery({
    queryKey: ["runs", "of", graph],
    queryFn: ({ signal }) => listComparable(runner, b, graph, null, 200, signal),
    enabled: graph !== "",
  });
  const before = useQuery({
    queryKey: ["runs", "before", graph, b],
    queryFn: ({ signal }) => listComparable(runner, b, graph, b, 1, signal),
    enabled: graph !== "" && !asked,
  });
  const first = before.data?.[0]?.id;
  useEffect(() => {
    if (first === undefined || asked) return;
    go(`/runs/compare?${new URLSearchParams({ a: first, b })}`, { replace: true });
  }, [first, asked, b, go]);
  if (second.isError)
    return (
      <Empty icon={<IconAlertTriangle size={22} />} title="This run cannot be compared">
        {errorText(second.error)}
      </Empty>
    );
  if (!asked && (before.isPending || first !== undefined)) return <Comparing />;
  const choices = (others.data ?? [])
    .filter((run) => run.id !== b)
    .map((run) => ({ value: run.id, label: `Run ${run.number} · ${runEndText(run)}` }));
  return (
    <Empty
      icon={<IconArrowsDiff size={22} />}
      title={
        asked
          ? "Which run do you want to compare with?"
          : before.isError
            ? "The run before could not be found. Which run do you want to compare with?"
            : "No run came before. Which run do you want to compare with?"
      }
    >
      <Select
        aria-label="Run to compare with"
        placeholder={
          choices.length === 0 && others.isSuccess ? "No other run of it" : "Choose a run"
        }
        data={choices}
        searchable
        onChange={(a) => a && go(`/runs/compare?${new URLSearchParams({ a, b })}`)}
      />
    </Empty>
  );
}

function Comparing() {
  return (
    <div className={style.inner} aria-busy="true">
      <Skeleton height={60} mb={12} />
      <Skeleton height={280} />
    </div>
  );
}

export function ComparePage({ bar }: { bar: (parts: RunBarParts) => ReactNode }) {
  const query = new URLSearchParams(useSearch());
  const [a, b] = [query.get("a") ?? "", query.get("b") ?? ""];
  const { runner } = useLive();
  const found = useComparison(runner, a, b);
  const isPhone = useIsPhone();
  const actions = a !== "" && b !== "" && (
    <>
      <Button
        component={Link}
        variant="default"
        to={`/runs/compare?${new URLSearchParams({ b, choose: "true" })}`}
      >
        Another run
      </Button>
      <Button
        component={Link}
        variant="default"
        to={`/runs/compare?${new URLSearchParams({ a: b, b: a })}`}
      >
        Swap
      </Button>
    </>
  );
  return (
    <>
      {bar({
        crumbs: [{ label: "Runs", to: "/runs" }, { label: "Compare" }],
        actions: isPhone ? null : actions,
      })}
      <main className="page">
        {isPhone && actions && <div className={style.tools}>{actions}</div>}
        {b === "" && (
          <Empty
            icon={<IconArrowsDiff size={22} />}
            title="Which runs?"
            action={
              <Button component={Link} variant="default" to="/runs">
                Open the list of runs
              </Button>
            }
          >
            Choose two in the list, or open one and press <b>Compare</b>.
          </Empty>
        )}
        {a === "" && runner !== undefined && b !== "" && (
          <Choose key={b} runner={runner} b={b} asked={query.has("choose")} />
        )}
        {found.isLoading && <Comparing />}
        {found.isError && (
          <Empty icon={<IconAlertTriangle size={22} />} title="These runs cannot be compared">
            {errorText(found.error)}
          </Empty>
        )}
        {found.data && <Found runner={runner} found={found.data} />}
      </main>
    </>
  );
}

function GraphChanges({ found }: { found: Comparison }) {
  const { subgraphs } = found;
  const isExact = subgraphs.length === 0 && valueDifferences(found).length === 0;
  const same = isExact ? "Both ran exactly the same graph." : "The graph was the same.";
  return (
    <>
      {subgraphs.length > 0 && (
        <p className={style.same}>
          Graphs inside were not the same: <bdi>{subgraphs.join(", ")}</bdi>.
        </p>
      )}
      {found.same_graph ? (
        <p className={style.same}>{same}</p>
      ) : (
        <DifferenceView found={found.graph} label="What changed in the graph" />
      )}
    </>
  );
}

function ValueChanges({ found }: { found: Comparison }) {
  const all = valueDifferences(found);
  if (all.length === 0) return null;
  return (
    <>
      <p className={style.same}>They were started with {counted(all.length, "different value")}:</p>
      <ul className="list-reset stack gap-50" aria-label="Different values">
        {all.map(({ place, words, a, b }) => (
          <li key={place} className="text-12 break-anywhere">
            <b>
              <bdi>{words}</bdi>
            </b>
            : <bdi>{a ?? "as in the graph"}</bdi> in run {found.a.number},{" "}
            <bdi>{b ?? "as in the graph"}</bdi> in run {found.b.number}
          </li>
        ))}
      </ul>
    </>
  );
}

/** Return how a visit ended; "ended, but nobody knows how" differs from "no end was seen". */
function outcome(visit: Visit): string {
  return visit.result ?? (visit.until === null ? "went on" : "result unknown");
}

function took(visit: Visit): string {
  if (visit.until === null) return "no end seen";
  return durationText(visitDuration(visit)) ?? "its code may go on";
}

function VisitCell({ visit, slower }: { visit: Visit | null; slower: boolean }) {
  if (visit === null) return <span className={style.none}>never ran</span>;
  const result = visit.result;
  const tone = result ?? (visit.until === null ? "run" : "unknown");
  return (
    <span className="inline-row gap-50">
      <StateLabel tone={tone} word={outcome(visit)} />
      <span className={style.took} data-slower={slower || undefined}>
        {took(visit)}
        {slower && " · slower"}
        {visit.robot && ` · on ${isolated(visit.robot)}`}
        {howWords(visit) && ` · ${howWords(visit)}`}
      </span>
    </span>
  );
}

const RELATIONS: Record<ComparedStep["relation"], string> = {
  same: "the same",
  result: "another result",
  only_a: "only in the first",
  only_b: "only in the second",
  unknown: "not known",
  end: "only one end was seen",
};

function Steps({ found }: { found: Comparison }) {
  const parting = found.parting?.step;
  const is = (step: ComparedStep) =>
    step.action === parting?.action && step.visit === parting.visit;
  return (
    <table className={style.steps}>
      <thead>
        <tr>
          <th>Action</th>
          <th>Run {found.a.number}</th>
          <th>Run {found.b.number}</th>
          <th>Both</th>
        </tr>
      </thead>
      <tbody>
        {found.steps.map((step) => (
          <tr
            key={`${step.action} ${step.visit}`}
            data-relation={step.relation}
            data-parting={is(step) || undefined}
          >
            <th scope="row">
              <bdi>{wayWords(step)}</bdi>
              {step.visit > 1 && <span className={style.none}> visit {step.visit}</span>}
            </th>
            <td>
              <VisitCell visit={step.a} slower={step.slower === "a"} />
            </td>
            <td>
              <VisitCell visit={step.b} slower={step.slower === "b"} />
            </td>
            <td className={style.relation}>
              {is(step) ? "here they part" : RELATIONS[step.relation]}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
