/** Lanes of a run over time: one for each action, with what is not known left hatched. */
import { Fragment, type PointerEvent, useEffect, useRef } from "react";
import type { Run, Visit } from "../api/runs";
import { colorOfName } from "../ui/name-colors";
import { duration, instant } from "../ui/times";
import { durationLabel } from "./durations";
import { progressOf, type Tone, visitBegin, visitEnd } from "./progress";
import { StateLabel, toneColor } from "./state-label";
import style from "./timeline.module.css";
import type { Lane } from "./timeline-lanes";

interface Props {
  run: Run;
  lanes: readonly Lane[];
  /** The end of the axis, ms. */
  until: number;
  unsure: boolean;
  selected?: string | null;
  onPick?: (aid: string) => void;
  /** Where a replay stands, ms; null at the live edge. */
  cursor?: number | null;
  onSeek?: (at: number) => void;
  signs?: readonly TimeSign[];
  gaps?: readonly TimeGap[];
  /** Runs that began together with this one, on the same axis. */
  others?: readonly Track[];
}

/** The lanes of one more run. */
export interface Track {
  run: Run;
  lanes: readonly Lane[];
}

/** A moment worth seeing on the axis: a stop, a pause, a proof, an alarm. */
export interface TimeSign {
  at: number;
  tone: Tone;
  text: string;
}

/** A time of which nothing is known, ms. */
export interface TimeGap {
  from: number;
  until: number;
  text: string;
}

interface Bar {
  /** Where it went on for certain; null where no such moment is known. */
  sure: { left: number; width: number } | null;
  tone: Tone;
  open: boolean;
  /** Where it may have gone on as well: nobody saw its ends. */
  maybe: { left: number; width: number } | null;
}

function barOf(
  visit: Visit,
  start: number,
  span: number,
  until: number,
  over: boolean,
): Bar | null {
  const from = visitBegin(visit);
  if (from === null) return null;
  const to = visitEnd(visit) ?? until;
  const open = visitEnd(visit) === null;
  const result = visit.result?.replace(/^on_/, "");
  const known =
    result === "true" || result === "false" || result === "error" || result === "stopped";
  const tone: Tone = known ? result : open && !over ? "run" : open ? "unknown" : "done";
  const at = (t: number) => Math.min(100, Math.max(0, ((t - start) / span) * 100));
  const earliest = instant(visit.not_before) ?? from;
  const latest = open ? to : (instant(visit.not_after) ?? until);
  const wider = at(latest) - at(earliest) - Math.max(0, at(to) - at(from)) > 0.5;
  return {
    sure: to > from || !wider ? { left: at(from), width: Math.max(0.4, at(to) - at(from)) } : null,
    tone,
    open: open && !over,
    maybe: wider ? { left: at(earliest), width: at(latest) - at(earliest) } : null,
  };
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

/** Everything that stands across the lanes: gaps, signs and the cursor. */
function Across(props: {
  share: (at: number) => number;
  cursor: number | null;
  signs: readonly TimeSign[];
  gaps: readonly TimeGap[];
}) {
  const { share, cursor, signs, gaps } = props;
  return (
    <div className={style.across} aria-hidden>
      {gaps.map((gap) => (
        <i
          key={gap.from}
          className={style.gap}
          title={gap.text}
          style={{ left: `${share(gap.from)}%`, width: `${share(gap.until) - share(gap.from)}%` }}
        />
      ))}
      {signs.map((sign) => (
        <i
          key={`${sign.at} ${sign.text}`}
          className={style.sign}
          title={sign.text}
          style={{ left: `${share(sign.at)}%`, color: toneColor[sign.tone] }}
        />
      ))}
      {cursor !== null && <i className={style.cursor} style={{ left: `${share(cursor)}%` }} />}
    </div>
  );
}

interface LaneRowProps {
  run: Run;
  lane: Lane;
  axis: { start: number; span: number; end: number };
  unsure: boolean;
  selected: string | null;
  onPick: ((aid: string) => void) | undefined;
}

function LaneRow({ run, lane, axis, unsure, selected, onPick }: LaneRowProps) {
  const over = run.ended_at !== null;
  const ended = instant(run.ended_at) ?? axis.end;
  const action = run.actions?.[lane.name];
  const visits = action?.visits ?? [];
  const progress = action ? progressOf(action, run, unsure) : null;
  return (
    <li
      className={style.lane}
      data-lane={lane.name}
      data-selected={(lane.aid !== null && lane.aid === selected) || undefined}
    >
      <button
        type="button"
        className={style.name}
        disabled={lane.aid === null || onPick === undefined}
        onClick={() => lane.aid && onPick?.(lane.aid)}
        title={lane.name}
      >
        <i style={{ background: colorOfName(lane.robot) }} aria-hidden />
        <span>{lane.robot === "" ? lane.name : `${lane.robot} · ${lane.name}`}</span>
      </button>
      <div className={style.track} aria-hidden>
        {visits.map((visit, i) => {
          const bar = barOf(visit, axis.start, axis.span, over ? ended : axis.end, over);
          if (!bar) return null;
          return (
            // biome-ignore lint/suspicious/noArrayIndexKey: visits only ever grow
            <Fragment key={i}>
              {bar.maybe && (
                <i
                  className={style.maybe}
                  data-bounds={bar.sure === null ? "all" : undefined}
                  title="It went on at some time within this: its ends were not seen exactly"
                  style={{
                    left: `${bar.maybe.left}%`,
                    width: `${bar.maybe.width}%`,
                    color: toneColor[bar.tone],
                  }}
                />
              )}
              {bar.sure && (
                <i
                  data-tone={unsure && bar.open ? "unknown" : bar.tone}
                  data-inferred={visit.how === "inferred" || undefined}
                  style={{
                    left: `${bar.sure.left}%`,
                    width: `${bar.sure.width}%`,
                    color: toneColor[bar.tone],
                  }}
                />
              )}
            </Fragment>
          );
        })}
      </div>
      <span className={style.state}>
        {progress && (
          <StateLabel tone={progress.tone} word={progress.word} {...durationLabel(progress)} />
        )}
      </span>
    </li>
  );
}

const NOTHING: readonly never[] = [];

/** What begins to run comes into view, within the list only. */
function useNewestInView(lanes: Props["lanes"], run: Run, live: boolean) {
  const list = useRef<HTMLUListElement>(null);
  const newest = live
    ? lanes.findLast(({ name }) => {
        const action = run.actions?.[name];
        return action !== undefined && progressOf(action, run, false)?.tone === "run";
      })?.name
    : undefined;
  useEffect(() => {
    const box = list.current;
    if (box === null || newest === undefined) return;
    const lane = box.querySelector<HTMLElement>(`[data-lane="${CSS.escape(newest)}"]`);
    if (lane === null) return;
    const [view, at] = [box.getBoundingClientRect(), lane.getBoundingClientRect()];
    if (at.bottom > view.bottom) box.scrollTop += at.bottom - view.bottom;
    else if (at.top < view.top) box.scrollTop -= view.top - at.top;
  }, [newest]);
  return list;
}

export function Timeline(props: Props) {
  const { run, lanes, until, unsure, selected = null, onPick, onSeek, cursor = null } = props;
  const start = instant(run.started_at) ?? until;
  const tracks: readonly Track[] = [{ run, lanes }, ...(props.others ?? NOTHING)];
  const end = instant(run.ended_at) ?? until;
  const span = Math.max(1000, end - start);
  const list = useNewestInView(lanes, run, run.ended_at === null && cursor === null);
  const share = (at: number) => Math.min(100, Math.max(0, ((at - start) / span) * 100));
  const seek = (event: PointerEvent<HTMLElement>) => {
    if (onSeek === undefined || (event.type === "pointermove" && event.buttons === 0)) return;
    if (event.type === "pointerdown") event.currentTarget.setPointerCapture(event.pointerId);
    const { left, width } = event.currentTarget.getBoundingClientRect();
    const part = Math.min(1, Math.max(0, (event.clientX - left) / width));
    onSeek(start + part * span);
  };
  return (
    <div className={style.timeline}>
      <div className={style.head}>
        <div
          className={style.ruler}
          data-seeks={onSeek !== undefined || undefined}
          onPointerDown={seek}
          onPointerMove={seek}
        >
          <Ticks span={span} />
        </div>
      </div>
      <Across
        share={share}
        cursor={cursor}
        signs={props.signs ?? NOTHING}
        gaps={props.gaps ?? NOTHING}
      />
      <ul ref={list} className={style.lanes} aria-label="Actions of the run over time">
        {tracks.flatMap((track) =>
          track.lanes.map((lane) => (
            <LaneRow
              key={`${track.run.id} ${lane.name}`}
              run={track.run}
              lane={lane}
              axis={{ start, span, end }}
              unsure={unsure && track.run.ended_at === null}
              selected={selected}
              onPick={onPick}
            />
          )),
        )}
      </ul>
    </div>
  );
}
