/** Lanes of runs over time, by robot: one for each action, with what is not known left hatched. */

import { ActionIcon, Button } from "@mantine/core";
import { IconZoomIn, IconZoomOut } from "@tabler/icons-react";
import {
  Fragment,
  type KeyboardEvent,
  type PointerEvent,
  useEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import { enginesOf } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import type { ActionRun, Run } from "../../api/runs";
import { shiftOfRun } from "../../api/site-places";
import { serverNow } from "../../clock/server-clock";
import { keyOf } from "../../ui/keys";
import { colorOfName, NAME_RANK, useNameColors } from "../../ui/name-colors";
import { duration, instant, stopwatch, useNow } from "../../ui/times";
import { Tooltip } from "../../ui/tooltip";
import { type Progress, progressOf, progressOfAction, type Tone } from "../progress";
import { endUnknownSince, silentSinceOf, useUnsure } from "../silence";
import { toneColor } from "../state-label";
import { waitingFor, waitWords } from "../waits";
import {
  growingSpan,
  isOn,
  originOf,
  partOf,
  presentOf,
  shareOf,
  type TimeAxis,
  type TimeRange,
  ticksOf,
  useMoving,
  WHOLE_WAY,
  wholeSpan,
  zoomed,
} from "./axis";
import { type HandOver, HandOverLines, handOversOf, handOverWords } from "./hand-overs";
import { AllLevels, LaneRow, type OpenLanes, useOpenLanes } from "./lane-row";
import { type Lane, openLanes, performerWords, robotsOf } from "./lanes";
import style from "./timeline.module.css";

interface Props extends Track {
  /** The name of a lane. */
  selected?: string | null;
  onPick?: ((lane: Lane) => void) | undefined;
  /** Returns whether a lane can be picked; without it, lanes of the graph itself can be. */
  picks?: (lane: Lane) => boolean;
  /** Time at which a replay stands, ms; null at the live edge. */
  cursor?: number | null;
  onSeek?: (at: number | null) => void;
  /** The keyboard seeks here: nothing else beside it does. */
  seeksByKeys?: boolean;
  signs?: readonly TimeSign[];
  gaps?: readonly TimeGap[];
  /** Runs on the same axis: those that began together with this one. */
  others?: readonly Track[];
  /** The part that is shown; null, or not set, is the whole. It is the whole at the live edge. */
  range?: TimeRange | null;
  /** Without it no part can be chosen. */
  onRange?: (range: TimeRange | null) => void;
}

/** The lanes of a run. */
export interface Track {
  run: Run;
  lanes: readonly Lane[];
  /** Since when nothing is heard of it, ms. */
  silentSince?: number | null;
}

/** A moment worth seeing on the axis: a stop, a pause, a proof, an alarm. */
export interface TimeSign {
  at: number;
  tone: Tone;
  text: string;
  /** True for what a person wrote there later. */
  note?: boolean;
}

/** A time of which nothing is known, ms. */
export interface TimeGap {
  from: number;
  until: number;
  text: string;
}

/** From the first start to the last end; while something goes on it grows in steps. */
function useAxis(tracks: readonly Track[]): TimeAxis {
  const shift = shiftOfRun(tracks[0]?.run.id ?? "");
  const present = serverNow() - shift;
  const starts = tracks.map(({ run }) => instant(run.started_at ?? run.requested_at));
  const start = Math.min(...starts.filter((each) => each !== null), present);
  const ends = tracks.map(({ run }) => instant(run.ended_at));
  const goes = ends.includes(null);
  const end = Math.max(...ends.map((each) => each ?? start));
  const [steps, setSteps] = useState(0);
  useEffect(() => {
    if (!goes) return;
    const timer = setInterval(() => setSteps(growingSpan(serverNow() - shift - start)), 250);
    return () => clearInterval(timer);
  }, [goes, start, shift]);
  const span = goes ? Math.max(steps, growingSpan(present - start)) : wholeSpan(end - start);
  return useMemo(() => ({ start, span, ...(shift !== 0 && { shift }) }), [start, span, shift]);
}

/** Return the place of a tick, in per cent of the axis. */
const tickAt = (axis: TimeAxis, t: number) => `${shareOf(axis, originOf(axis) + t) * 100}%`;

/** Return the time of a tick, with tenths where there are several in a second. */
function tickText(t: number): string {
  if (t < 60_000) return `${t / 1000} s`;
  const tenths = Math.round((t % 1000) / 100);
  return tenths === 0 ? duration(t) : `${duration(t)}.${tenths}`;
}

function Ticks({ axis }: { axis: TimeAxis }) {
  return (
    <div className={style.axis} aria-hidden>
      {ticksOf(axis).map((t) => (
        <span
          className="absolute nowrap"
          key={t}
          data-last={shareOf(axis, originOf(axis) + t) > 0.97 || undefined}
          style={{ left: tickAt(axis, t) }}
        >
          {tickText(t)}
        </span>
      ))}
    </div>
  );
}

interface AcrossProps {
  axis: TimeAxis;
  cursor: number | null;
  goes: boolean;
  silentSince: number | null;
  signs: readonly TimeSign[];
  gaps: readonly TimeGap[];
}

/** Marks that cross all lanes: ticks, gaps, signs and the playhead. */
function Across({ axis, cursor, goes, silentSince, signs, gaps }: AcrossProps) {
  const at = (moment: number) => shareOf(axis, moment) * 100;
  return (
    <div className={style.across} aria-hidden>
      {ticksOf(axis).map((t) => (
        <i key={t} className={style.tick} style={{ left: tickAt(axis, t) }} />
      ))}
      {gaps
        .filter(({ from, until }) => isOn(axis, from, until))
        .map((gap) => (
          <i
            key={gap.from}
            className={style.gap}
            title={gap.text}
            style={{ left: `${at(gap.from)}%`, width: `${at(gap.until) - at(gap.from)}%` }}
          />
        ))}
      {signs
        .filter((sign) => isOn(axis, sign.at))
        .map((sign) => (
          <i
            key={`${sign.at} ${sign.text}`}
            className={style.sign}
            data-note={sign.note || undefined}
            title={sign.text}
            style={{ left: `${at(sign.at)}%`, color: toneColor[sign.tone] }}
          />
        ))}
      <Playhead axis={axis} cursor={cursor} goes={goes} silentSince={silentSince} />
    </div>
  );
}

const NOTHING: readonly never[] = [];
/** Place to which a lane is scrolled into view, as a share of the height of the list. */
const RESTS_AT = 0.4;

/** Scroll a lane into view when it begins to run, with room for the lanes that follow. */
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
    // Seldom, as the view of the canvas: rows that come into sight have the page laid out once more.
    if (at.bottom > view.bottom || at.top < view.top)
      box.scrollTop += at.top - view.top - view.height * RESTS_AT;
  }, [newest]);
  return list;
}

/** Pulling over the ruler or the lanes goes to that moment; keys go in seconds. */
function useSeeking(axis: TimeAxis, cursor: number | null, onSeek: Props["onSeek"]) {
  const ruler = useRef<HTMLDivElement>(null);
  const seek = (event: PointerEvent<HTMLElement>) => {
    const box = ruler.current?.getBoundingClientRect();
    if (onSeek === undefined || box === undefined) return;
    if (event.type === "pointermove" && event.buttons === 0) return;
    const on = event.target as Element;
    const held = event.currentTarget.hasPointerCapture(event.pointerId);
    if (!held && on.closest("[data-track], [data-ruler]") === null) return;
    if (event.type === "pointerdown") event.currentTarget.setPointerCapture(event.pointerId);
    const part = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
    onSeek(axis.start + part * axis.span);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const key = keyOf(event);
    const here = cursor ?? Math.min(presentOf(axis), axis.start + axis.span);
    const goal = new Map<string, number | null>([
      ["ArrowLeft", here - 1000],
      ["ArrowRight", cursor === null ? null : here + 1000],
      ["Home", originOf(axis)],
      ["End", null],
    ]);
    if (onSeek === undefined || !goal.has(key)) return;
    event.preventDefault();
    event.stopPropagation();
    onSeek(goal.get(key) ?? null);
  };
  return { ruler, pull: { onPointerDown: seek, onPointerMove: seek }, onKeyDown };
}

/** Return the slider attributes and keys of the ruler, for people without a pointer. */
function sliderOf(axis: TimeAxis, cursor: number | null) {
  const at = cursor === null ? axis.span : cursor - originOf(axis);
  return {
    role: "slider",
    tabIndex: 0,
    "aria-label": "Moment of the run",
    "aria-valuemin": 0,
    "aria-valuemax": Math.round(axis.span / 1000),
    "aria-valuenow": Math.round(at / 1000),
    "aria-valuetext": cursor === null ? "now" : stopwatch(at),
  } as const;
}

const isOwn = (lane: Lane): boolean => lane.aid !== null;

interface GroupsProps extends Pick<Props, "selected" | "onPick" | "picks"> {
  track: Track;
  axis: TimeAxis;
  inside: OpenLanes;
  /** Robots have their names above their lanes. */
  named: boolean;
  overs: readonly HandOver[];
}

/** The lanes of one run, those of each robot together. */
function Groups({ track, axis, named, overs, inside, ...props }: GroupsProps) {
  const { selected = null, picks = isOwn, onPick } = props;
  const { run, silentSince = null } = track;
  const lanes = openLanes(track.lanes, inside.open);
  const nested = track.lanes.some(({ holds }) => holds);
  const waited = new Map(overs.map((over) => [over.to, handOverWords(over)]));
  const ended = instant(run.ended_at);
  const silent = ended === null ? silentSince : null;
  const { now } = useLive();
  const unsure = useUnsure(run);
  const unknownSince = (action: ActionRun) =>
    endUnknownSince(action, run) ?? silentSinceOf(action, now);
  const progressIn = (name: string): Progress | null => {
    const action = run.actions?.[name];
    return action ? progressOfAction(name, action, run, silent !== null || unsure) : null;
  };
  const progressIs = ({ name, needs }: Lane): Progress | null => {
    const own = progressIn(name);
    if (own === null || needs === undefined) return own;
    return waitingFor(
      own,
      waitWords(needs, (other) => progressIn(other)?.tone),
    );
  };
  return robotsOf(lanes).map((robot) => (
    <Fragment key={robot}>
      {named && (
        <li className={style.robot} style={{ color: colorOfName(robot) }}>
          <i style={{ background: colorOfName(robot) }} aria-hidden />
          <bdi>{performerWords(robot)}</bdi>
        </li>
      )}
      {lanes
        .filter((lane) => lane.robot === robot)
        .map((lane) => {
          const action = run.actions?.[lane.name];
          return (
            <LaneRow
              key={lane.name}
              lane={lane}
              visits={action?.visits ?? NOTHING}
              progress={progressIs(lane)}
              axis={axis}
              ended={ended}
              silentSince={silent ?? (action && ended === null ? unknownSince(action) : null)}
              selected={lane.name === selected}
              onPick={picks(lane) ? onPick : undefined}
              waited={waited.get(lane.name) ?? ""}
              opened={lane.holds ? inside.open.has(lane.name) : null}
              nested={nested}
              onOpen={inside.toggle}
            />
          );
        })}
    </Fragment>
  ));
}

/** Return the names of the robots that a track shows: of its lanes, and the engines of its run. */
const namesIn = ({ run, lanes }: Track): string[] => [...robotsOf(lanes), ...enginesOf(run)];

export function Timeline(props: Props) {
  const { run, lanes, onSeek, cursor = null, signs = NOTHING, gaps = NOTHING } = props;
  const tracks: readonly Track[] = [props, ...(props.others ?? NOTHING)];
  const inside = useOpenLanes();
  const whole = useAxis(tracks);
  const goes = tracks.some((track) => track.run.ended_at === null);
  const isLive = goes && cursor === null;
  const { range = null, onRange } = props;
  const axis = useMemo(() => partOf(whole, isLive ? null : range), [whole, isLive, range]);
  const silentSince = run.ended_at === null ? (props.silentSince ?? null) : null;
  useNameColors(NAME_RANK.run, tracks.flatMap(namesIn));
  const shown = useMemo(() => openLanes(lanes, inside.open), [lanes, inside.open]);
  const list = useNewestInView(shown, run, run.ended_at === null && cursor === null);
  const overs = useMemo(() => handOversOf(run, lanes), [run, lanes]);
  const { ruler, pull, onKeyDown } = useSeeking(axis, cursor, onSeek);
  const named = tracks.length > 1 || robotsOf(lanes).length > 1;
  const slider = props.seeksByKeys && onSeek ? { ...sliderOf(axis, cursor), onKeyDown } : {};
  return (
    <div className={style.timeline} data-seeks={onSeek !== undefined || undefined} {...pull}>
      <div className={style.head}>
        <AllLevels lanes={tracks.flatMap((track) => track.lanes)} inside={inside} />
        <div ref={ruler} className={style.ruler} data-ruler {...slider}>
          <Ticks axis={axis} />
        </div>
        {onRange !== undefined && (
          <Zoom whole={whole} cursor={cursor} range={range} onRange={onRange} isLive={isLive} />
        )}
      </div>
      <Across {...{ axis, cursor, goes, silentSince, signs, gaps }} />
      <ul
        ref={list}
        className={`list-reset ${style.lanes}`}
        aria-label="Actions of the run over time"
      >
        {tracks.map((track) => (
          <Groups
            key={track.run.id}
            track={track}
            axis={axis}
            named={named}
            overs={track.run.id === run.id ? overs : NOTHING}
            inside={inside}
            selected={props.selected ?? null}
            onPick={props.onPick}
            {...(props.picks ? { picks: props.picks } : {})}
          />
        ))}
        {overs.length > 0 && <HandOverLines overs={overs} axis={axis} lanes={shown} />}
      </ul>
    </div>
  );
}

interface ZoomProps extends Required<Pick<Props, "cursor" | "range" | "onRange">> {
  whole: TimeAxis;
  isLive: boolean;
}

/** Show half of what is shown, around the chosen moment, or twice as much. */
function Zoom({ whole, cursor, range, onRange, isLive }: ZoomProps) {
  const { from, until } = range ?? { from: whole.start, until: whole.start + whole.span };
  const around = cursor ?? (from + until) / 2;
  const closer = zoomed(range, whole, around, 0.5);
  const isCloser = !isLive && closer !== null && closer.until - closer.from < until - from;
  return (
    <span className={style.zoom}>
      <Tooltip label={isLive ? "Zoom into the time: choose a moment first" : "Zoom into the time"}>
        <ActionIcon
          size={24}
          aria-label="Zoom into the time"
          aria-disabled={!isCloser || undefined}
          onClick={() => isCloser && onRange(closer)}
        >
          <IconZoomIn size={15} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Tooltip label="Zoom out of the time">
        <ActionIcon
          size={24}
          aria-label="Zoom out of the time"
          aria-disabled={isLive || range === null || undefined}
          onClick={() => isLive || onRange(zoomed(range, whole, around, 2))}
        >
          <IconZoomOut size={15} aria-hidden />
        </ActionIcon>
      </Tooltip>
      {range !== null && !isLive && (
        <Button size="compact-xs" variant="subtle" onClick={() => onRange(null)}>
          All
        </Button>
      )}
    </span>
  );
}

/** Side on which the sign of a moment has room beside its line. */
type Side = "left" | "right" | undefined;

const sideOf = (share: number): Side => (share > 0.9 ? "left" : share < 0.06 ? "right" : undefined);

function Cursor({ side, label, live }: { side: Side; label: string; live: boolean }) {
  return (
    <i className={style.cursor} data-live={live || undefined}>
      <b data-side={side}>{label}</b>
    </i>
  );
}

/** Playhead at the present: its text is rendered once a second, and its line moves meanwhile. */
function LiveCursor({ axis, silentSince }: { axis: TimeAxis; silentSince: number | null }) {
  const now = useNow(1000) - (axis.shift ?? 0);
  const words = silentSince === null ? "live" : "not known";
  const label = `${stopwatch(now - axis.start)} ${words}`;
  return <Cursor side={sideOf(shareOf(axis, now))} label={label} live={silentSince === null} />;
}

/** Moves with time. `silentSince`: what it shows is not known from there on. */
function LiveHead({ axis, silentSince }: { axis: TimeAxis; silentSince: number | null }) {
  const sweep = useRef<HTMLDivElement>(null);
  useMoving(sweep, axis, WHOLE_WAY);
  return (
    <div ref={sweep} className={style.sweep}>
      <LiveCursor axis={axis} silentSince={silentSince} />
    </div>
  );
}

interface PlayheadProps {
  axis: TimeAxis;
  /**
   * Time at which a replay stands, ms; null at the live edge, or at the end of a run that is over.
   */
  cursor: number | null;
  goes: boolean;
  silentSince: number | null;
}

function Playhead({ axis, cursor, goes, silentSince }: PlayheadProps) {
  if (cursor !== null) {
    if (!isOn(axis, cursor)) return null;
    const share = shareOf(axis, cursor);
    return (
      <>
        <i className={style.later} style={{ left: `${share * 100}%` }} />
        <div className={style.sweep} style={{ transform: `translateX(${share * 100}%)` }}>
          <Cursor side={sideOf(share)} label={stopwatch(cursor - originOf(axis))} live={false} />
        </div>
      </>
    );
  }
  return goes ? <LiveHead axis={axis} silentSince={silentSince} /> : null;
}
