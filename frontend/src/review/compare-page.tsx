/** Two runs side by side: what differed before they began, and the step in which they part. */
import { Button, Select, Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconArrowsDiff } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { authorName } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/live/use-live";
import {
  type ComparedField,
  type ComparedStep,
  type Comparison,
  listRuns,
  NO_FILTER,
  useComparison,
} from "../api/review";
import { getRun, type Run, type Visit } from "../api/runs";
import { boundsText, durationText } from "../status/durations";
import { runEndText, runLabel, visitDuration } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { Empty } from "../ui/empty";
import { clock, day, instant, useNow } from "../ui/times";
import style from "./compare-page.module.css";
import type { RunBarParts } from "./run/run-page";

/** How it ended; that nobody knows how is something else than that nobody saw an end. */
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
    <span className={style.visit}>
      <StateLabel tone={tone} word={outcome(visit)} />
      <span className={style.took} data-slower={slower || undefined}>
        {took(visit)}
        {slower && " · slower"}
        {visit.how === "inferred" && " · inferred"}
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
              {step.action}
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

/** The value inside a parameter's JSON text, or the text itself. */
function plain(value: unknown): string {
  if (value === null || value === undefined) return "—";
  if (typeof value !== "string") return JSON.stringify(value);
  try {
    const parsed: unknown = JSON.parse(value);
    if (typeof parsed === "object" && parsed !== null && "pvf_value" in parsed) {
      return JSON.stringify(parsed.pvf_value);
    }
    return typeof parsed === "string" ? parsed : value;
  } catch {
    return value;
  }
}

function fieldWords(field: string): string {
  if (field.startsWith("in/")) return `input ${field.slice(3)}`;
  if (field.startsWith("out/")) return `output ${field.slice(4)}`;
  if (field.startsWith("remap/")) return `remap of ${field.slice(6)}`;
  return field.replaceAll("_", " ");
}

function Fields({ fields }: { fields: readonly ComparedField[] }) {
  return (
    <ul className={style.fields}>
      {fields.map((field) => (
        <li key={field.field}>
          <span>{fieldWords(field.field)}</span> <del>{plain(field.before)}</del>{" "}
          <ins>{plain(field.after)}</ins>
        </li>
      ))}
    </ul>
  );
}

function Differences({ found }: { found: Comparison }) {
  const { actions, relations } = found.graph;
  const meaning = actions
    .map((each) => ({ ...each, fields: each.fields.filter((f) => f.field !== "position") }))
    .filter((each) => each.change !== "changed" || each.fields.length > 0);
  if (found.same_graph) return <p className={style.same}>Both ran exactly the same graph.</p>;
  return (
    <ul className={style.changes} aria-label="What changed in the graph">
      {meaning.map((change) => (
        <li key={change.aid}>
          <b>{change.name}</b> <span className={style.change}>{change.change}</span>
          <Fields fields={change.fields} />
        </li>
      ))}
      {relations.map((change) => (
        <li key={`${change.parent} ${change.child}`}>
          <b>
            {change.parent} → {change.child}
          </b>{" "}
          <span className={style.change}>{change.change}</span>
          <Fields fields={change.fields} />
        </li>
      ))}
    </ul>
  );
}

function Head({ run, title }: { run: Run; title: string }) {
  const now = useNow(60_000);
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  const { tone, word } = runLabel(run);
  return (
    <section className={style.run} aria-label={title}>
      <Link to={`/runs/${run.id}`} className={style.link}>
        Run {run.number} · {run.graph_name}
      </Link>
      <StateLabel pill tone={tone} word={end === null ? word : runEndText(run)} />
      <span className={style.meta}>
        {run.simulated ? "simulator" : run.engine} · {authorName(run.author)}
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

function Found({ found }: { found: Comparison }) {
  return (
    <div className={style.inner}>
      <div className={style.pair}>
        <Head run={found.a} title="First run" />
        <Head run={found.b} title="Second run" />
      </div>
      <section className={style.verdict} data-parts={found.parting !== null || undefined}>
        <IconArrowsDiff size={18} aria-hidden />
        <div>
          <p>{found.text}</p>
          <Said found={found} />
        </div>
      </section>
      <section className={style.card}>
        <h3>Before they began</h3>
        {!found.same_engine && (
          <p className={style.same}>
            They ran in different places: {found.a.engine} and {found.b.engine}.
          </p>
        )}
        <Differences found={found} />
      </section>
      <section className={style.card}>
        <h3>Step by step</h3>
        <div className={style.scroll}>
          <Steps found={found} />
        </div>
        {found.left_out > 0 && (
          <p className={style.same}>{found.left_out} later steps are not listed.</p>
        )}
      </section>
    </div>
  );
}

/** Chooses the run to compare with, among those of the same graph. */
function Choose({ runner, b }: { runner: string; b: string }) {
  const [, go] = useLocation();
  const second = useQuery({
    queryKey: ["runs", "one", b],
    queryFn: ({ signal }) => getRun(runner, b, signal),
  });
  const graph = second.data?.graph ?? second.data?.graph_name ?? "";
  const others = useQuery({
    queryKey: ["runs", "of", graph],
    queryFn: ({ signal }) => listRuns(runner, { ...NO_FILTER, graph }, null, 200, signal),
    enabled: graph !== "",
  });
  const choices = (others.data ?? [])
    .filter((run) => run.id !== b)
    .map((run) => ({ value: run.id, label: `Run ${run.number} · ${runEndText(run)}` }));
  return (
    <Empty icon={<IconArrowsDiff size={22} />} title="Compare with which run?">
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

export function ComparePage({ bar }: { bar: (parts: RunBarParts) => ReactNode }) {
  const query = new URLSearchParams(useSearch());
  const [a, b] = [query.get("a") ?? "", query.get("b") ?? ""];
  const { runner } = useLive();
  const found = useComparison(runner, a, b);
  return (
    <>
      {bar({
        crumbs: [{ label: "Runs", to: "/runs" }, { label: "Compare" }],
        actions: a !== "" && b !== "" && (
          <Button
            component={Link}
            variant="default"
            to={`/runs/compare?${new URLSearchParams({ a: b, b: a })}`}
          >
            Swap
          </Button>
        ),
      })}
      <main className={style.page}>
        {a === "" && runner !== undefined && b !== "" && <Choose runner={runner} b={b} />}
        {found.isLoading && (
          <div className={style.inner} aria-busy="true">
            <Skeleton height={60} mb={12} />
            <Skeleton height={280} />
          </div>
        )}
        {found.isError && (
          <Empty icon={<IconAlertTriangle size={22} />} title="These runs cannot be compared">
            {errorText(found.error)}
          </Empty>
        )}
        {found.data && <Found found={found.data} />}
      </main>
    </>
  );
}
