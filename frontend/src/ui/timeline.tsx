/** Lanes of a run over time: one for each action, with what is not known left hatched. */
import { begun, ended, progressOf, type Tone } from "../api/progress";
import type { Run, Visit } from "../api/runs";
import type { Lane } from "./lanes";
import { robotColor } from "./robot";
import { StateWord, toneColor } from "./state-word";
import style from "./timeline.module.css";
import { duration, instant } from "./when";

interface Props {
  run: Run;
  lanes: readonly Lane[];
  /** The end of the axis, ms. */
  until: number;
  unsure: boolean;
  selected?: string | null;
  onPick?: (aid: string) => void;
}

interface Bar {
  left: number;
  width: number;
  tone: Tone;
  open: boolean;
}

function barOf(
  visit: Visit,
  start: number,
  span: number,
  until: number,
  over: boolean,
): Bar | null {
  const from = begun(visit);
  if (from === null) return null;
  const to = ended(visit) ?? until;
  const open = ended(visit) === null;
  const result = visit.result?.replace(/^on_/, "");
  const known =
    result === "true" || result === "false" || result === "error" || result === "stopped";
  const tone: Tone = known ? result : open && !over ? "run" : open ? "unknown" : "done";
  const at = (t: number) => Math.min(100, Math.max(0, ((t - start) / span) * 100));
  return { left: at(from), width: Math.max(0.4, at(to) - at(from)), tone, open: open && !over };
}

function Ticks({ span }: { span: number }) {
  const steps = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600];
  const step = (steps.find((s) => span / 1000 / s <= 8) ?? 7200) * 1000;
  const ticks = Array.from({ length: Math.floor(span / step) + 1 }, (_, i) => i * step);
  return (
    <div className={style.axis} aria-hidden>
      {ticks.map((t) => (
        <span key={t} style={{ left: `${(t / span) * 100}%` }}>
          {t < 60_000 ? `${t / 1000} s` : duration(t)}
        </span>
      ))}
    </div>
  );
}

export function Timeline({ run, lanes, until, unsure, selected = null, onPick }: Props) {
  const start = instant(run.started_at) ?? until;
  const over = run.ended_at !== null;
  const end = instant(run.ended_at) ?? until;
  const span = Math.max(1000, end - start);
  return (
    <div className={style.timeline}>
      <div className={style.head}>
        <Ticks span={span} />
      </div>
      <ul className={style.lanes} aria-label="Actions of the run over time">
        {lanes.map((lane) => {
          const action = run.actions?.[lane.name];
          const visits = action?.visits ?? [];
          const progress = action ? progressOf(action, run, unsure) : null;
          return (
            <li
              key={lane.name}
              className={style.lane}
              data-selected={(lane.aid !== null && lane.aid === selected) || undefined}
            >
              <button
                type="button"
                className={style.name}
                disabled={lane.aid === null || onPick === undefined}
                onClick={() => lane.aid && onPick?.(lane.aid)}
                title={lane.name}
              >
                <i style={{ background: robotColor(lane.robot) }} aria-hidden />
                <span>{lane.robot === "" ? lane.name : `${lane.robot} · ${lane.name}`}</span>
              </button>
              <div className={style.track} aria-hidden>
                {visits.map((visit, i) => {
                  const bar = barOf(visit, start, span, end, over);
                  if (!bar) return null;
                  return (
                    <i
                      // biome-ignore lint/suspicious/noArrayIndexKey: visits only ever grow
                      key={i}
                      data-tone={unsure && bar.open ? "unknown" : bar.tone}
                      data-inferred={visit.how === "inferred" || undefined}
                      style={{
                        left: `${bar.left}%`,
                        width: `${bar.width}%`,
                        color: toneColor[bar.tone],
                      }}
                    />
                  );
                })}
              </div>
              <span className={style.state}>
                {progress && (
                  <StateWord
                    tone={progress.tone}
                    word={progress.word}
                    {...(progress.took === null ? {} : { more: duration(progress.took) })}
                  />
                )}
              </span>
            </li>
          );
        })}
      </ul>
    </div>
  );
}
