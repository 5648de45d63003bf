/** What has become of starts that nobody answered: unknown until the runner tells, never sent again. */
import { CloseButton, Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useEffect, useSyncExternalStore } from "react";
import { Link } from "wouter";
import { useLive } from "../../api/live/use-live";
import { SIMULATOR } from "../../api/robots";
import { findStart, type Run, type StartFound } from "../../api/runs";
import { useRunStatus } from "../../status/run-status";
import { colorOfName } from "../../ui/name-colors";
import { isolated } from "../../words/isolated";
import style from "./unanswered-start-notice.module.css";
import { type SentStart, unansweredStarts } from "./unanswered-starts";

const AGAIN = 2_000; // ms between two looks
const PATIENCE = 5_000; // ms that one look waits

/** The engines of a start that the runner has no run for. */
export function missing(sent: SentStart, found: StartFound | undefined): string[] {
  const there = new Set((found?.runs ?? []).map((run) => run.engine));
  return sent.engines.filter((engine) => !there.has(engine));
}

/** What is known of those without a run, and what is not. */
export function unknownWords(
  sent: SentStart,
  found: StartFound | undefined,
  silent: boolean,
): string | null {
  const left = missing(sent, found);
  if (left.length === 0) return null;
  const where = left.map((engine) => (engine === SIMULATOR ? "the simulator" : engine));
  const head = `NOT KNOWN whether ${sent.what} started on ${where.map(isolated).join(", ")}.`;
  const after = "It is looked for, and not sent again. Stop works.";
  if (silent || found === undefined) return `${head} The runner has not answered. ${after}`;
  if (found.under_way) return `${head} The runner is still carrying it out. ${after}`;
  return `${head} The runner has nothing of it so far. ${after}`;
}

function Found({ run }: { run: Run }) {
  const { word } = useRunStatus(run);
  return (
    <p className={style.found}>
      <i style={{ background: colorOfName(run.engine) }} aria-hidden />
      <span>
        Started after all: <Link to={`/runs/${run.id}`}>run {run.number}</Link> on{" "}
        {run.simulated ? "the simulator" : run.engine}, {word}.
      </span>
    </p>
  );
}

function Start({ sent }: { sent: SentStart }) {
  const { live, runner, now } = useLive();
  const look = useQuery({
    queryKey: ["starts", sent.request],
    queryFn: ({ signal }) => findStart(runner ?? "", sent.request, PATIENCE, signal),
    enabled: runner !== undefined,
    refetchInterval: ({ state }) => (missing(sent, state.data).length > 0 ? AGAIN : false),
    retry: false,
    staleTime: 0,
  });
  const found = look.data;
  useEffect(() => {
    for (const run of found?.runs ?? []) live?.learn(run);
  }, [found, live]);
  const runs = (found?.runs ?? []).map((run) => now.runs.get(run.id) ?? run);
  const unknown = unknownWords(sent, found, look.isError || now.link === "down");
  const told = unknown === null || (found !== undefined && !found.under_way && !look.isError);
  return (
    <div className={style.start} data-unknown={unknown !== null || undefined}>
      <div>
        {unknown !== null && <p role="alert">{unknown}</p>}
        {runs.map((run) => (
          <Found key={run.id} run={run} />
        ))}
      </div>
      {told ? (
        <CloseButton
          size="sm"
          aria-label="Hide"
          onClick={() => unansweredStarts.settle(sent.request)}
        />
      ) : (
        <Loader size="xs" color="currentColor" aria-label="Looking" />
      )}
    </div>
  );
}

export function UnansweredStartNotice() {
  const starts = useSyncExternalStore(unansweredStarts.subscribe, unansweredStarts.list);
  if (starts.length === 0) return null;
  return (
    <section className={style.notice} aria-label="Starts that are not sure">
      {starts.map((sent) => (
        <Start key={sent.request} sent={sent} />
      ))}
    </section>
  );
}
