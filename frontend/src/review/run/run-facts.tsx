/** What a run was, in a table. */

import { useRaw } from "../../api/review";
import { type Run, requesterPlace, runPlace } from "../../api/runs";
import { boundsText } from "../../status/durations";
import { runEndText } from "../../status/progress";
import { clock, day, instant, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import style from "./run-facts.module.css";

type Rest = NonNullable<Run["at_rest"]>;

interface Props {
  runner: string | undefined;
  run: Run;
  version: string;
  by: string;
}

function restWords(rest: Rest, moment: (at: number | null) => string): string {
  const who = rest.by ? `by ${isolated(rest.by.name)}${requesterPlace(rest.by)}` : "by the runner";
  return `${moment(instant(rest.at))} ${who}: “${rest.how}”`;
}

export function RunFacts({ runner, run, version, by }: Props) {
  const raw = useRaw(runner, run).data;
  const now = useNow(60_000);
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  const moment = (at: number | null) => (at === null ? "—" : `${day(at, now)} ${clock(at)}`);
  const rows: [string, string][] = [
    ["Graph", run.graph_name],
    ["Version", version],
    ["Digest", run.digest],
    ["Engine", runPlace(run)],
    ["Started by", `${by}${requesterPlace(run.author)}`],
    ["Started", moment(start)],
    ...(run.stopped_by
      ? [
          ["Stopped by", `${run.stopped_by.name}${requesterPlace(run.stopped_by)}`] as [
            string,
            string,
          ],
        ]
      : []),
    ["End known", moment(end)],
    ["Took", (end !== null && boundsText(run.took)) || "—"],
    ["End", end === null ? "goes on" : runEndText(run)],
    ["Result", run.result?.replace(/^on_/, "") ?? "—"],
    ["Why", run.detail || "—"],
    ["Recorded", run.recorded ? "all of it" : "NOT all of it: the journal could not be written"],
    ...(run.archived
      ? [
          ["Archived", `${moment(instant(run.archived.at))}, ${run.archived.file}`] as [
            string,
            string,
          ],
        ]
      : []),
    ...(raw
      ? [["Raw messages", raw.text || `here, ${raw.hours.length} h`] as [string, string]]
      : []),
    ["Last proof", moment(instant(run.proof_at))],
    ...(run.at_rest ? [["Seen at rest", restWords(run.at_rest, moment)] as [string, string]] : []),
    ...(run.despite ?? []).map(({ code, text }): [string, string] => ["In spite of", text ?? code]),
    ...(run.override ? [["Because", `“${run.override.reason}”`] as [string, string]] : []),
  ];
  return (
    <dl className={style.facts}>
      {rows.map(([name, value]) => (
        <div key={`${name} ${value}`}>
          <dt>{name}</dt>
          <dd className={name === "Digest" ? style.mono : undefined}>{value}</dd>
        </div>
      ))}
    </dl>
  );
}
