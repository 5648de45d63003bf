/** At the right of the lanes: what is known of one action, and how old that is. */
import { useMemo } from "react";
import { engineWords } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { type Run, useRun } from "../../api/runs";
import { fullName, type Graph, type Key } from "../../graph/model";
import { spokenName } from "../../graph/spoken-name";
import { visitBegin, visitEnd } from "../../status/progress";
import { duration, instant, stopwatch, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import style from "./run-drawer.module.css";

/** Shows the age of the newest answer of the engine, updated once a second. */
function Age({ run }: { run: Run }) {
  const { live } = useLive();
  const present = useNow(1000, run.ended_at === null);
  // biome-ignore lint/correctness/useExhaustiveDependencies: as old as it was when the clock struck
  const seen = useMemo(() => live?.runSeenAt.get(run.id), [live, run.id, present]);
  if (run.ended_at !== null) return null;
  return <span>{seen === undefined ? "no proof yet" : `${duration(present - seen)} old`}</span>;
}

interface Props {
  run: Run;
  graph: Graph;
  /** The action; null: none is chosen, and none runs. */
  aid: Key | null;
}

export function ValuesPanel({ run, graph, aid }: Props) {
  const { runner } = useLive();
  const sent = useRun(runner, run.id).data?.sent;
  const found = aid === null ? null : valuesOf(run, graph, aid, sent);
  if (found === null) {
    return (
      <aside className={style.values} aria-label="Values">
        <p>Choose a lane to see with which values it ran.</p>
      </aside>
    );
  }
  const own = Object.values(run.actions ?? {}).find((action) => action.aid === aid)?.robot;
  const whose = own ? isolated(own) : engineWords(run);
  const onlySent = found.values.some(({ from }) => from === "sent");
  return (
    <aside className={style.values} aria-label={`Values of ${isolated(spokenName(found.name))}`}>
      <h2>
        {spokenName(found.name)}
        {!run.simulated && ` on ${whose}`}
        <Age run={run} />
      </h2>
      <dl>
        {found.values.map(({ name, text, from }) => (
          <div key={name} data-from={from}>
            <dt>{name}</dt>
            <dd title={text}>{text}</dd>
          </div>
        ))}
      </dl>
      {found.values.length + found.outputs.length === 0 && <p>No value of it is known.</p>}
      {onlySent && <p>These values were sent; the values that it runs with were not seen.</p>}
      {found.outputs.length > 0 && (
        <>
          <p>Its outputs, as observed:</p>
          <dl>
            {found.outputs.map(({ name, text }) => (
              <div key={name} data-from="ran">
                <dt>{name}</dt>
                <dd title={text}>{text}</dd>
              </div>
            ))}
          </dl>
        </>
      )}
      {found.said !== null && <blockquote>“{found.said}”</blockquote>}
      {found.after.length > 0 && (
        <p className={style.after}>
          Began after:{" "}
          {found.after.map(({ name, result, at }, i) => (
            <span key={name}>
              {i > 0 && ", "}
              <b>{spokenName(name)}</b> {result} {at !== null && stopwatch(at)}
            </span>
          ))}
        </p>
      )}
    </aside>
  );
}

interface KnownValue {
  readonly name: string;
  readonly text: string;
  /** `ran`: the engine showed that it ran with it; `sent`: only what was sent is known. */
  readonly from: "ran" | "sent";
}

/** An action that was seen to end before this one began, along an arrow that answers its end. */
interface BeganAfter {
  readonly name: string;
  readonly result: string;
  /** ms from the run's start to its end; null if that end was not seen exactly. */
  readonly at: number | null;
}

export interface ActionValues {
  readonly name: string;
  readonly values: readonly KnownValue[];
  /** Outputs that an answer showed after its last visit. */
  readonly outputs: readonly Omit<KnownValue, "from">[];
  readonly said: string | null;
  readonly after: readonly BeganAfter[];
}

/** The value that a parameter's JSON text carries. */
export function valueText(text: string): string {
  try {
    const parsed: unknown = JSON.parse(text);
    if (typeof parsed === "object" && parsed !== null && "pvf_value" in parsed) {
      return JSON.stringify(parsed.pvf_value);
    }
  } catch {
    // not JSON: shown as it is
  }
  return text;
}

function beganAfter(run: Run, graph: Graph, key: Key, begun: number | null): BeganAfter[] {
  const start = instant(run.started_at);
  if (begun === null || start === null) return [];
  const names = new Map(graph.actions.map((action) => [action.key, fullName(action)]));
  return graph.relations.flatMap((relation): BeganAfter[] => {
    const name = relation.child === key ? names.get(relation.parent) : undefined;
    if (name === undefined) return [];
    const visits = run.actions?.[name]?.visits ?? [];
    const last = visits.findLast((visit) => (visitEnd(visit) ?? Number.POSITIVE_INFINITY) <= begun);
    const end = last ? visitEnd(last) : null;
    const outcome = last?.result ? (`on_${last.result}` as const) : null;
    if (end === null || outcome === null || relation.conditions[outcome] === "ignore") return [];
    const exact = last?.not_after === last?.until;
    return [{ name, result: last?.result ?? "", at: exact ? end - start : null }];
  });
}

/**
 * Return the values of an action in a run; null if the run has none of it. `sent`: the values that were sent with the
 * run, by full name.
 */
export function valuesOf(
  run: Run,
  graph: Graph,
  aid: Key,
  sent: Run["sent"] | undefined,
): ActionValues | null {
  const found = Object.entries(run.actions ?? {}).find(([, action]) => action.aid === aid);
  if (found === undefined) return null;
  const [name, action] = found;
  const last = action.visits.at(-1);
  const ran = last?.inputs ?? null;
  const shown = (values: Readonly<Record<string, string>>) =>
    Object.entries(values).map(([parameter, text]) => ({
      name: parameter.replaceAll("::", " / "),
      text: valueText(text),
    }));
  const from = ran === null ? "sent" : "ran";
  const values = shown(ran ?? sent?.[name] ?? {}).map((each): KnownValue => ({ ...each, from }));
  const begun = last ? visitBegin(last) : null;
  return {
    name,
    values,
    outputs: shown(last?.outputs ?? {}),
    said: action.messages.at(-1)?.text ?? null,
    after: beganAfter(run, graph, aid, begun),
  };
}
