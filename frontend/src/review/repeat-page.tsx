/** A repeat: the table of its runs, what closed it, and the word of a person that starts the next one. */
import { Button, Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconDownload, IconRepeat } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { Link } from "wouter";
import { errorText, unconfirmed } from "../api/http";
import { useMissingSites } from "../api/missing-sites";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import {
  closeRepeat,
  type Repeat,
  type RepeatSummary,
  reopenRepeat,
  startCell,
  tableUrl,
  useCellLook,
  useRepeat,
  useRepeats,
} from "../api/repeats";
import type { Run } from "../api/runs";
import { boundsText } from "../status/durations";
import { useRunStatus } from "../status/progress";
import { SecondPerson } from "../status/second-person";
import { SilentSites } from "../status/silent-sites";
import { StateLabel } from "../status/state-label";
import { lineWords, valueLines } from "../status/value-words";
import { useWatching, WatchTicks } from "../status/watching";
import { Empty } from "../ui/empty";
import { HoldButton } from "../ui/hold-button";
import { clock, day, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./repeat-page.module.css";
import type { RunBarParts } from "./run-page";

type Cell = Repeat["cells"][number];

/** Return between which bounds the runs that ended took; "" while none has. */
export function rangeWords(
  runs: readonly (Pick<NonNullable<Cell["run"]>, "ended_at" | "took"> | null)[],
): string {
  const known = runs.flatMap((run) => (run?.ended_at && run.took ? [run.took] : []));
  if (known.length === 0) return "";
  const least = Math.min(...known.map((each) => each.least));
  const tops = known.map((each) => each.most);
  const most = tops.some((each) => each === null) ? null : Math.max(...tops.map(Number));
  return boundsText({ least, most }) ?? "";
}

const where = ({ robots }: RepeatSummary): string =>
  robots.length === 0 ? "in the simulator" : `on ${robots.map(isolated).join(", ")}`;

function State({ run }: { run: NonNullable<Cell["run"]> }) {
  const { tone, word } = useRunStatus(run as unknown as Run);
  return <StateLabel tone={tone} word={word} />;
}

function Row({ cell, isNext, now }: { cell: Cell; isNext: boolean; now: number }) {
  const { run } = cell;
  const start = instant(run?.started_at);
  const words = valueLines(cell.values).map((line) => isolated(lineWords(line)));
  return (
    <tr data-next={isNext || undefined}>
      <td className="ink3">{cell.cell}</td>
      <td>{run ? <State run={run} /> : <span className="ink3">{isNext ? "next" : "—"}</span>}</td>
      <td>{run && <Link to={`/runs/${run.id}`}>Run {run.number}</Link>}</td>
      {words.length > 0 && <td className={style.values}>{words.join(", ")}</td>}
      <td>{run && (boundsText(run.took) ?? "")}</td>
      <td>{run && <bdi>{run.author.name}</bdi>}</td>
      <td className="ink2">{start !== null && `${day(start, now)} ${clock(start)}`}</td>
      <td className={style.why}>{run?.cause || run?.detail}</td>
    </tr>
  );
}

function Table({ repeat }: { repeat: Repeat }) {
  const now = useNow(60_000);
  const hasValues = repeat.cells.some(({ values }) => valueLines(values).length > 0);
  return (
    // biome-ignore lint/a11y/noNoninteractiveTabindex: a table wider than the screen is scrolled by keys
    <section className={style.scroll} tabIndex={0} aria-label="Runs of the repeat">
      <table className={style.table}>
        <thead>
          <tr>
            <th>#</th>
            <th>End</th>
            <th>Run</th>
            {hasValues && <th>Values</th>}
            <th>Took</th>
            <th>Started by</th>
            <th>Started</th>
            <th>Why</th>
          </tr>
        </thead>
        <tbody>
          {repeat.cells.map((cell) => (
            <Row
              key={cell.cell}
              cell={cell}
              isNext={repeat.closed === null && cell.cell === repeat.next}
              now={now}
            />
          ))}
        </tbody>
      </table>
    </section>
  );
}

/** Buttons of a person: start the next run, close the repeat, open it again. */
function Commands({ repeat, runner }: { repeat: Repeat; runner: string }) {
  const client = useQueryClient();
  const moves = repeat.robots.length > 0;
  const may = useMay(moves ? "operate" : "simulate");
  const watch = useWatching(repeat.robots);
  const renew = () => client.invalidateQueries({ queryKey: ["repeats"] });
  const said = { onSettled: renew };
  const { id, next, total } = repeat;
  const start = useMutation({
    mutationFn: () => startCell(runner, id, next ?? 0, watch.watching),
    onSettled: () => {
      watch.forget();
      return renew();
    },
  });
  const close = useMutation({ mutationFn: () => closeRepeat(runner, id), ...said });
  const again = useMutation({
    mutationFn: () => reopenRepeat(runner, repeat, watch.watching),
    ...said,
  });
  const error = start.error ?? close.error ?? again.error;
  const isOpen = repeat.closed === null;
  const offers = may && next !== null && !repeat.by_itself && isOpen;
  const what = `${next === 1 ? "start" : "reset done, start"} run ${next} of ${total}`;
  const label = next === 1 ? `Start run 1 of ${total}` : `Reset done: start ${next} of ${total}`;
  const waits = may && moves && next !== null && repeat.state !== "running";
  const look = useCellLook(runner, repeat, waits);
  const disabled = repeat.state !== "waiting" || start.isPending || watch.obstacle !== null;
  return (
    <section className={style.commands} aria-label="Commands">
      {(offers || (!isOpen && next !== null && may)) && <WatchTicks watch={watch} />}
      <div className={style.buttons}>
        {offers && (
          <HoldButton
            label={watch.obstacle ?? label}
            name={`${label} ${where(repeat)}`}
            question={`Everything is set back, and you have looked: ${what} of ${isolated(repeat.graph_name)} ${where(repeat)}?`}
            disabled={disabled}
            onHeld={() => start.mutate()}
          />
        )}
        {isOpen && (
          <Button variant="default" loading={close.isPending} onClick={() => close.mutate()}>
            Stop repeating
          </Button>
        )}
        {!isOpen && next !== null && may && (
          <Button
            variant="default"
            loading={again.isPending}
            disabled={repeat.state === "running"}
            onClick={() => again.mutate()}
          >
            Look again, and open it
          </Button>
        )}
        <TableFile href={tableUrl(runner, id, "csv")} name="CSV" />
        {repeat.parquet && <TableFile href={tableUrl(runner, id, "parquet")} name="Parquet" />}
      </div>
      {waits && (
        <SecondPerson
          graph={repeat.graph ?? ""}
          label={`all of ${counted(total, "run")}`}
          looks={look.data}
          values={{}}
          taken={null}
        />
      )}
      {!repeat.parquet && (
        <details className="quiet-12">
          <summary>Parquet</summary>
          For this table as Parquet, with typed columns, the Python of the runner needs pyarrow:{" "}
          <code>pip install 'temoto-action-assistant[parquet]'</code>
        </details>
      )}
      {isOpen && repeat.state === "running" && (
        <p className="m-0 quiet-12">
          <b>Stop repeating</b> lets this run go on. STOP stops it, and closes the repeat.
        </p>
      )}
      {error && (
        <p role="alert" className={style.error}>
          {errorText(error)}{" "}
          {errorText(error).includes("onfirm") && (
            <Button size="compact-xs" onClick={() => unconfirmed.set([...repeat.robots])}>
              Confirm that it is you …
            </Button>
          )}
        </p>
      )}
    </section>
  );
}

/** Link to the table as a file of one form. */
function TableFile({ href, name }: { href: string; name: string }) {
  return (
    <Button
      component="a"
      href={href}
      variant="subtle"
      leftSection={<IconDownload size={14} aria-hidden />}
    >
      {name}
    </Button>
  );
}

function stateWords({ state, closed, next, total }: Repeat): string {
  if (closed) return closed.why === "complete" ? "Complete" : "Closed";
  if (state === "running") return "A run goes on";
  if (state === "between") return `Run ${next} of ${total} is about to start`;
  return `Waits for a person: run ${next} of ${total}`;
}

function Found({ repeat, runner }: { repeat: Repeat; runner: string }) {
  const range = rangeWords(repeat.cells.map(({ run }) => run));
  const isDoubted = repeat.closed !== null && repeat.closed.why !== "complete";
  return (
    <div className={style.inner}>
      <div className="page-head">
        <h2 className="page-title">
          <bdi>{repeat.graph_name}</bdi>, {counted(repeat.total, "run")} {where(repeat)}
        </h2>
      </div>
      <p className={style.state} role="status" data-doubt={isDoubted || undefined}>
        <b>{stateWords(repeat)}.</b> {repeat.closed?.text} {repeat.finished} of {repeat.total}{" "}
        finished{range && `, in ${range}`}.
        {repeat.seed !== null && ` Shuffled by the seed ${repeat.seed}.`}
        {repeat.reopened_by && ` Opened again by ${isolated(repeat.reopened_by.name)}.`}
      </p>
      <progress className={style.progress} max={repeat.total} value={repeat.finished}>
        {repeat.finished} of {repeat.total}
      </progress>
      <Commands repeat={repeat} runner={runner} />
      <Table repeat={repeat} />
    </div>
  );
}

interface PageProps {
  bar: (parts: RunBarParts) => ReactNode;
}

const RUNS = { label: "Runs", to: "/runs" };
const REPEATS = { label: "Repeats", to: "/runs/repeats" };

export function RepeatPage({ id, bar }: PageProps & { id: string }) {
  const { runner } = useLive();
  const found = useRepeat(runner, id);
  return (
    <>
      {bar({ crumbs: [RUNS, REPEATS, { label: found.data?.graph_name ?? "Repeat" }] })}
      <main className="page">
        {found.isLoading && <Skeleton height={280} />}
        {found.isError && !found.data && (
          <Empty icon={<IconAlertTriangle size={22} />} title="The repeat could not be loaded">
            {errorText(found.error)}
          </Empty>
        )}
        {found.data && runner && <Found repeat={found.data} runner={runner} />}
      </main>
    </>
  );
}

export function RepeatsPage({ bar }: PageProps) {
  const { runner } = useLive();
  const found = useRepeats(runner);
  const isWhole = useMissingSites("get /api/repeats").length === 0;
  const now = useNow(60_000);
  return (
    <>
      {bar({ crumbs: [RUNS, { label: "Repeats" }] })}
      <main className="page">
        <div className={style.inner}>
          <div className="page-head">
            <h2 className="page-title">Repeats</h2>
          </div>
          {found.isError && (
            <Empty
              icon={<IconAlertTriangle size={22} />}
              title="The list of repeats could not be loaded"
            >
              {errorText(found.error)}
            </Empty>
          )}
          <SilentSites route="get /api/repeats" missing="what is repeated there is not known" />
          {found.data?.length === 0 && isWhole && (
            <Empty icon={<IconRepeat size={22} />} title="Nothing was repeated yet">
              Choose <b>Repeat it</b> before a start: several times, or with each of several values.
            </Empty>
          )}
          <ul className={style.list}>
            {found.data?.map((each) => {
              const at = instant(each.opened_at) ?? 0;
              return (
                <li key={each.id}>
                  <Link to={`/runs/repeats/${each.id}`}>
                    <bdi>{each.graph_name}</bdi>, {counted(each.total, "run")} {where(each)}
                  </Link>{" "}
                  <span className="quiet-12">
                    {day(at, now)} {clock(at)}, <bdi>{each.author.name}</bdi>.{" "}
                    {each.closed ? each.closed.text : "Open."}
                  </span>
                </li>
              );
            })}
          </ul>
        </div>
      </main>
    </>
  );
}
