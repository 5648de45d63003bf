/** What happened in a run, in order, in sentences. */

import { authorName } from "../api/graphs";
import { begun, ended, endWords, type Tone } from "../api/progress";
import type { Run } from "../api/runs";
import { toneColor } from "../ui/state-word";
import { clock, instant } from "../ui/when";
import style from "./events.module.css";

interface Happening {
  at: number;
  tone: Tone;
  name: string | null;
  aid: string | null;
  text: string;
}

function spaced(fullName: string): string {
  return fullName.replace(/_(\d+)$/, " $1");
}

/** Everything that the run tells, oldest first. */
export function happenings(run: Run, version: string): Happening[] {
  const all: Happening[] = [];
  const start = instant(run.started_at);
  if (start !== null) {
    const where = run.simulated ? "in the simulator" : `on ${run.engine}`;
    const text = `${authorName(run.author)} started ${version} ${where}`;
    all.push({ at: start, tone: "idle", name: null, aid: null, text });
  }
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    action.visits.forEach((visit, i) => {
      const from = begun(visit);
      const until = ended(visit);
      const again = i > 0 ? `again (${i + 1}.)` : "";
      const who = { name: spaced(name), aid: action.aid };
      if (from !== null) all.push({ at: from, tone: "run", ...who, text: `runs ${again}`.trim() });
      if (until !== null) {
        const result = visit.result?.replace(/^on_/, "") ?? null;
        const tone = (result ?? "done") as Tone;
        const seen = visit.how === "inferred" ? " (inferred)" : "";
        all.push({ at: until, tone, ...who, text: (result ?? "finished") + seen });
      }
    });
    for (const message of action.messages) {
      const at = instant(message.at);
      if (at === null) continue;
      all.push({
        at,
        tone: "idle",
        name: spaced(name),
        aid: action.aid,
        text: `“${message.text}”`,
      });
    }
  }
  for (const line of run.log ?? []) {
    const at = instant(line.at);
    if (at !== null) all.push({ at, tone: "idle", name: "engine", aid: null, text: line.text });
  }
  for (const alarm of run.alarms) {
    const at = instant(alarm.at);
    if (at !== null) all.push({ at, tone: "error", name: null, aid: null, text: alarm.text });
  }
  const end = instant(run.ended_at);
  if (end !== null)
    all.push({
      at: end,
      tone: "idle",
      name: null,
      aid: null,
      text: `Run ${endWords(run)}${run.detail ? `: ${run.detail}` : ""}`,
    });
  return all.sort((a, b) => a.at - b.at);
}

interface Props {
  run: Run;
  version: string;
  selected: string | null;
  onPick: (aid: string | null) => void;
}

export function Events({ run, version, selected, onPick }: Props) {
  const start = instant(run.started_at) ?? 0;
  return (
    <ol className={style.events}>
      {happenings(run, version).map((event, i) => (
        <li
          // biome-ignore lint/suspicious/noArrayIndexKey: the list is only ever appended to
          key={i}
          className={style.event}
          data-selected={(event.aid !== null && event.aid === selected) || undefined}
        >
          <time className={style.time} dateTime={new Date(event.at).toISOString()}>
            {i === 0 ? clock(event.at) : `+${((event.at - start) / 1000).toFixed(1)}`}
          </time>
          <span>
            {event.name !== null && (
              <button type="button" className={style.name} onClick={() => onPick(event.aid)}>
                {event.name}
              </button>
            )}{" "}
            <span style={event.tone === "idle" ? {} : { color: toneColor[event.tone] }}>
              {event.text}
            </span>
          </span>
        </li>
      ))}
    </ol>
  );
}
