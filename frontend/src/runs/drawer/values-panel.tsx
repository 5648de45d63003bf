/** At the right of the lanes: what is known of one action, and how old that is. */

import { useMemo } from "react";
import { useLive } from "../../api/live/use-live";
import { type Run, useRun } from "../../api/runs";
import type { Graph, Key } from "../../graph/model";
import { spaced } from "../../status/level-words";
import { duration, stopwatch, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import { valuesOf } from "./action-values";
import style from "./run-drawer.module.css";

/** How old the newest answer of the engine is; looked at once a second, with all that tells times. */
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
  const onlySent = found.values.some(({ from }) => from === "sent");
  return (
    <aside className={style.values} aria-label={`Values of ${spaced(found.name)}`}>
      <h2>
        {spaced(found.name)}
        {!run.simulated && ` on ${isolated(run.engine)}`}
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
      {found.values.length === 0 && <p>It has no value that is known.</p>}
      {onlySent && <p>As sent: with what it runs was not seen.</p>}
      {found.said !== null && <blockquote>“{found.said}”</blockquote>}
      {found.after.length > 0 && (
        <p className={style.after}>
          Began after:{" "}
          {found.after.map(({ name, result, at }, i) => (
            <span key={name}>
              {i > 0 && ", "}
              <b>{spaced(name)}</b> {result} {stopwatch(at)}
            </span>
          ))}
        </p>
      )}
    </aside>
  );
}
