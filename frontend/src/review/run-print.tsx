/** The record of a run on paper: what each action did, when as far as that is known, and who started it. */

import { actorWords } from "../api/people";
import { limitWords, pageWords } from "../api/rights";
import { type Run, requesterPlace, runPlace, type Visit } from "../api/runs";
import { serverNow } from "../clock/server-clock";
import { boundsText, durationText } from "../status/durations";
import { fromWords } from "../status/earlier-list";
import { actionWords, spokenIn } from "../status/level-places";
import { howWords, progressOf, runEndText, visitDuration } from "../status/progress";
import { useUnsure } from "../status/silence";
import { valuesWords } from "../status/value-words";
import { PrintSheet } from "../ui/print-sheet";
import { clock, dateText, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./run-print.module.css";

const exact = (at: number) => `${clock(at)}.${Math.floor((at % 1000) / 100)}`;

/** Return when an event happened: between two proofs, or after one of them. */
export function rangeText(from: string | null, to: string | null): string {
  const [least, most] = [instant(from), instant(to)];
  if (least === null) return most === null ? "not known" : `by ${exact(most)}`;
  if (most === null) return `after ${exact(least)}`;
  return exact(least) === exact(most) ? exact(least) : `${exact(least)}–${exact(most)}`;
}

function endOf(visit: Visit, over: boolean, unknown: boolean): string {
  if (visit.until === null && visit.not_after === null)
    return over ? "not seen" : unknown ? "not known" : "goes on";
  return rangeText(visit.until, visit.not_after);
}

interface VisitRowsProps {
  run: Run;
  name: string;
  action: NonNullable<Run["actions"]>[string];
}

function ActionRows({ run, name, action }: VisitRowsProps) {
  const now = progressOf(action, run, useUnsure(run));
  const over = run.ended_at !== null;
  if (action.visits.length === 0) {
    return (
      <tr>
        <td>{name}</td>
        <td colSpan={5}>{now.word}</td>
      </tr>
    );
  }
  return action.visits.map((visit, i) => {
    const last = i === action.visits.length - 1;
    const word = last ? now.word : (visit.result ?? "finished");
    return (
      <tr key={`${visit.from} ${visit.not_before}`}>
        <td>
          {name}
          {action.robot && ` on ${isolated(action.robot)}`}
        </td>
        <td>
          {action.at_least && "≥ "}
          {action.older + i + 1}
        </td>
        <td>
          {word}
          {howWords(visit) && ` (${howWords(visit)})`}
        </td>
        <td>{rangeText(visit.not_before, visit.from)}</td>
        <td>{endOf(visit, over, last && now.tone === "unknown")}</td>
        <td>{durationText(visitDuration(visit)) ?? "not known"}</td>
      </tr>
    );
  });
}

function Actions({ run }: { run: Run }) {
  const actions = Object.entries(run.actions ?? {});
  const begin = ([, action]: (typeof actions)[number]) =>
    Date.parse(action.visits[0]?.from ?? "9999-01-01");
  const inOrder = actions.sort((a, b) => begin(a) - begin(b));
  return (
    <table className={style.table}>
      <thead>
        <tr>
          <th scope="col">Action</th>
          <th scope="col">Visit</th>
          <th scope="col">State</th>
          <th scope="col">Began</th>
          <th scope="col">Ended</th>
          <th scope="col">Took</th>
        </tr>
      </thead>
      <tbody>
        {inOrder.map(([name, action]) => (
          <ActionRows key={name} run={run} name={actionWords(run, name)} action={action} />
        ))}
      </tbody>
    </table>
  );
}

export function RunPrint({ run, version, by }: { run: Run; version: string; by: string }) {
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  const moment = (at: number) => `${dateText(at)} ${exact(at)}`;
  const stopped = run.stopped_by;
  const now = serverNow();
  return (
    <PrintSheet
      title={`Run ${run.number} of ${isolated(run.graph_name)}`}
      facts={[
        ["Version", version],
        ["Digest", run.digest],
        ...(run.from ? [["Began", fromWords(run.from)] as const] : []),
        ...(run.values ? [["Started with", valuesWords(run.values)] as const] : []),
        ...(run.sent_digest ? [["Digest with that", run.sent_digest] as const] : []),
        ...Object.entries(run.limits ?? {}).map(
          ([robot, limits]) =>
            ["Limits", `${isolated(robot)}: ${limits.map(limitWords).join(", ")}`] as const,
        ),
        ...Object.entries(run.pages ?? {}).map(
          ([robot, page]) => ["Visible page", `${isolated(robot)}: ${pageWords(page)}`] as const,
        ),
        ...Object.entries(run.health ?? {}).map(
          ([robot, said]) => [`Health of ${isolated(robot)}`, said.join(" ")] as const,
        ),
        ["Robot", runPlace(run)],
        ["Started by", `${by}${requesterPlace(run.author)}`],
        ["Started", start === null ? "not known to have begun" : moment(start)],
        ...(stopped
          ? [
              [
                "Stopped by",
                `${actorWords(stopped, stopped.name)}${requesterPlace(stopped)}`,
              ] as const,
            ]
          : []),
        ["End known", end === null ? "goes on" : moment(end)],
        ["Took", (end !== null && boundsText(run.took)) || "not known"],
        ["Outcome", end === null ? "goes on" : runEndText(run)],
        ...(run.detail ? [["Why", spokenIn(run, run.detail)] as const] : []),
        ["Recorded", run.recorded ? "all of it" : "NOT all of it"],
        ["Printed", `${dateText(now)} ${clock(now)}`],
      ]}
      content={() => ({
        body: (
          <>
            <Actions run={run} />
            <p className={style.note}>
              A range lies between the last proof before and the first proof after. Inferred:
              concluded from what was seen before and after.
            </p>
          </>
        ),
      })}
    />
  );
}
