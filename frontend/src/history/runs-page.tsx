/** What ran: newest first, with who, when, how long and how it ended. */
import { SegmentedControl, Skeleton, TextInput } from "@mantine/core";
import { IconAlertTriangle, IconHistory, IconSearch } from "@tabler/icons-react";
import { useMemo, useState } from "react";
import { Link, useLocation } from "wouter";
import { authorName } from "../api/graphs";
import { sentence } from "../api/http";
import { endWords, runWord } from "../api/progress";
import { hasEnded, type Run, useRuns } from "../api/runs";
import { useLive } from "../api/use-live";
import { Empty } from "../ui/empty";
import { StateWord } from "../ui/state-word";
import { clock, day, duration, instant, stopwatch, useNow } from "../ui/when";
import style from "./runs-page.module.css";
import { useVersionLabel } from "./version-label";

const FILTERS = [
  { value: "all", label: "All" },
  { value: "open", label: "Running" },
  { value: "good", label: "Finished" },
  { value: "bad", label: "Failed" },
  { value: "stopped", label: "Stopped" },
];

export function passes(run: Run, filter: string): boolean {
  switch (filter) {
    case "open":
      return !hasEnded(run);
    case "good":
      return run.state === "finished" && run.result !== "on_error";
    case "bad":
      return ["error", "refused", "lost"].includes(run.state) || run.result === "on_error";
    case "stopped":
      return run.state === "stopped" || run.state === "halted";
    default:
      return true;
  }
}

/** The stored list, overlaid with what the live socket knows better. */
export function merged(stored: readonly Run[], live: ReadonlyMap<string, Run>): Run[] {
  const all = new Map(stored.map((run) => [run.id, run]));
  for (const [id, run] of live) all.set(id, run);
  return [...all.values()].sort((a, b) => b.number - a.number);
}

function Row({ run, now }: { run: Run; now: number }) {
  const [, go] = useLocation();
  const label = useVersionLabel(run);
  const { tone, word } = runWord(run);
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  const took = start === null ? "" : end === null ? stopwatch(now - start) : duration(end - start);
  const to = `/runs/${run.id}`;
  return (
    <tr className={style.row} onClick={() => go(to)}>
      <td className={style.state}>
        <StateWord tone={tone} word={run.ended_at === null ? word : endWords(run)} />
      </td>
      <td>
        <Link to={to} className={style.link} onClick={(event) => event.stopPropagation()}>
          <span className={style.number}>Run {run.number}</span> {run.graph_name}
        </Link>
      </td>
      <td>
        <span className={style.version}>{label}</span>
      </td>
      <td className={style.quiet}>{run.simulated ? "simulator" : run.engine}</td>
      <td>{authorName(run.author)}</td>
      <td className={style.quiet}>{start !== null && `${day(start, now)} ${clock(start)}`}</td>
      <td className={style.took}>{took}</td>
    </tr>
  );
}

function Rows({ runs }: { runs: readonly Run[] }) {
  const going = runs.some((run) => !hasEnded(run));
  const now = useNow(going ? 1000 : 30_000);
  return (
    <div className={style.frame}>
      <table className={style.table}>
        <thead>
          <tr>
            <th>State</th>
            <th>Run</th>
            <th>Version</th>
            <th>On</th>
            <th>Started by</th>
            <th>Started</th>
            <th className={style.took}>Took</th>
          </tr>
        </thead>
        <tbody>
          {runs.map((run) => (
            <Row key={run.id} run={run} now={now} />
          ))}
        </tbody>
      </table>
    </div>
  );
}

export function RunsPage() {
  const { runner, now } = useLive();
  const stored = useRuns(runner);
  const [search, setSearch] = useState("");
  const [filter, setFilter] = useState("all");
  const runs = useMemo(() => merged(stored.data ?? [], now.runs), [stored.data, now.runs]);
  const shown = runs.filter(
    (run) =>
      passes(run, filter) &&
      `${run.number} ${run.graph_name} ${authorName(run.author)}`
        .toLowerCase()
        .includes(search.trim().toLowerCase()),
  );
  return (
    <main className={style.page}>
      <div className={style.inner}>
        <div className={style.head}>
          <h2 className={style.title}>Runs</h2>
          <TextInput
            aria-label="Search runs"
            placeholder="Graph, person or number"
            leftSection={<IconSearch size={15} aria-hidden />}
            value={search}
            onChange={(event) => setSearch(event.currentTarget.value)}
            className={style.search ?? ""}
          />
          <SegmentedControl size="xs" data={FILTERS} value={filter} onChange={setFilter} />
        </div>
        {stored.isPending && (
          <div aria-hidden>
            {[0, 1, 2, 3, 4].map((i) => (
              <Skeleton key={i} height={40} mb={6} />
            ))}
          </div>
        )}
        {stored.isError && runs.length === 0 && (
          <Empty icon={<IconAlertTriangle size={22} />} title="The runs cannot be read">
            {sentence(stored.error)} What was recorded is safe; it shows again when the runner
            answers.
          </Empty>
        )}
        {stored.isSuccess && runs.length === 0 && (
          <Empty icon={<IconHistory size={22} />} title="Nothing ran yet">
            Open a graph and hold <b>Start</b>. Every run is kept here, with its exact version and
            what each action did.
          </Empty>
        )}
        {shown.length > 0 && <Rows runs={shown} />}
        {runs.length > 0 && shown.length === 0 && (
          <Empty icon={<IconSearch size={22} />} title="No run fits">
            {runs.length} others do not match this search and filter.
          </Empty>
        )}
      </div>
    </main>
  );
}
