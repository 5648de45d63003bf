/** One action over time: its visits as bars, and how it is now at the right. */

import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import { type CSSProperties, Fragment, memo, useCallback, useMemo, useRef, useState } from "react";
import type { Visit } from "../../api/runs";
import { spokenName } from "../../graph/spoken-name";
import { colorOfName } from "../../ui/name-colors";
import { stopwatch, useNow } from "../../ui/times";
import { durationText } from "../durations";
import { wayWords } from "../level-places";
import { type Progress, type Tone, visitsText } from "../progress";
import { StateLabel, toneColor } from "../state-label";
import { type Bar, barOf, growingWay, shareOf, type TimeAxis, useMoving } from "./axis";
import type { Lane } from "./lanes";
import style from "./timeline.module.css";

interface Props {
  lane: Lane;
  visits: readonly Visit[];
  progress: Progress | null;
  axis: TimeAxis;
  /** End of its run, ms; null while it goes on. */
  ended: number | null;
  /** Since when nothing is heard of its run, ms. */
  silentSince: number | null;
  selected: boolean;
  onPick: ((lane: Lane) => void) | undefined;
  /** The time from another robot's action to the begin of the newest visit, in words; "" if unknown. */
  waited: string;
  /** True if its inner lanes are shown, false if hidden; null if it has none. */
  opened: boolean | null;
  /** Set if any lane has inner lanes: then all names leave room for the toggle. */
  nested: boolean;
  onOpen: (name: string) => void;
}

const DEEPEST = 6; // levels by which names are indented; deeper ones stand below those

/** Its name, below the name of the action that it is inside of. */
function LaneName({ lane, onPick, opened, nested, onOpen }: Omit<Props, "visits">) {
  const indent = { "--depth": Math.min(DEEPEST, lane.levels.length) } as CSSProperties;
  const way = wayWords({ levels: lane.levels, name: lane.label });
  return (
    <span className={style.first} style={indent}>
      {nested && <LaneToggle words={way} opened={opened} onOpen={() => onOpen(lane.name)} />}
      <button
        type="button"
        className={style.name}
        disabled={onPick === undefined}
        onClick={() => onPick?.(lane)}
        title={way}
        aria-label={lane.levels.length > 0 ? way : undefined}
      >
        <i style={{ background: colorOfName(lane.robot) }} aria-hidden />
        <span className="truncate">
          <bdi>{spokenName(lane.label)}</bdi>
        </span>
      </button>
    </span>
  );
}

const percent = (share: number) => `${share * 100}%`;

/** Bar from a moment to now: it is moved, not rendered again, while time passes. */
function Growing({ axis, from, ...look }: GrowingProps) {
  const left = shareOf(axis, from);
  const grown = useRef<HTMLElement>(null);
  useMoving(
    grown,
    axis,
    useMemo(() => growingWay(left), [left]),
  );
  return (
    <span className={style.grows} style={{ left: percent(left) }}>
      <i
        ref={grown}
        className={look.className}
        data-tone={look.tone}
        style={look.tone && { color: toneColor[look.tone] }}
      />
    </span>
  );
}

interface GrowingProps {
  axis: TimeAxis;
  from: number;
  tone?: Tone;
  className?: string | undefined;
}

function Fixed({ bar, inferred }: { bar: Bar; inferred: boolean }) {
  const { sure, maybe, tone } = bar;
  const color = toneColor[tone];
  return (
    <>
      {maybe && (
        <i
          className={style.maybe}
          data-bounds={sure === null ? "all" : undefined}
          title="It ran at some time within this range: its begin and end were not seen exactly"
          style={{ left: percent(maybe.left), width: percent(maybe.width), color }}
        />
      )}
      {sure && (
        <i
          data-tone={tone}
          data-inferred={inferred || undefined}
          style={{ left: percent(sure.left), width: percent(sure.width), color }}
        />
      )}
    </>
  );
}

/** One visit. What goes on is drawn up to now; from where nothing is heard any more, hatched. */
function VisitBar(props: Pick<Props, "axis" | "ended" | "silentSince"> & { visit: Visit }) {
  const { visit, axis, ended, silentSince } = props;
  const known = ended ?? silentSince;
  const bar = barOf(visit, axis, known ?? axis.start + axis.span, ended !== null);
  if (bar === null) return null;
  const grows = bar.open && silentSince === null && bar.sure !== null;
  if (!grows) return <Fixed bar={bar} inferred={visit.how === "inferred"} />;
  const from = axis.start + (bar.sure?.left ?? 0) * axis.span;
  return <Growing axis={axis} from={from} tone="run" className={style.open} />;
}

/** Shows how long a visit has been going on. */
function Since({ progress, since }: { progress: Progress; since: number }) {
  const now = useNow(1000);
  return (
    <StateLabel tone={progress.tone} word={progress.word} more={stopwatch(now - since)} still />
  );
}

function LaneState({ progress }: { progress: Progress }) {
  if (progress.since !== null && progress.tone === "run") {
    return <Since progress={progress} since={progress.since} />;
  }
  const took = durationText(progress);
  const often = visitsText(progress);
  const more = [took, often].filter(Boolean).join(" · ");
  return (
    <StateLabel
      tone={progress.tone}
      word={progress.word}
      still
      {...(more === "" ? {} : { more })}
    />
  );
}

/** Return whether an action that has not begun says more than fits its column; nothing is on its track. */
const isLong = (progress: Progress | null): boolean =>
  progress?.tone === "idle" && progress.word.length > 14;

export const LaneRow = memo(function LaneRow(props: Props) {
  const { lane, visits, progress, axis, ended, silentSince, selected, waited } = props;
  const silent = ended === null ? silentSince : null;
  const was = visits.at(-1)?.until === null;
  return (
    <li className={style.lane} data-lane={lane.name} data-selected={selected || undefined}>
      <LaneName {...props} />
      <div className={style.track} data-track aria-hidden>
        {visits.map((visit, i) => (
          // biome-ignore lint/suspicious/noArrayIndexKey: visits only ever grow
          <Fragment key={i}>
            <VisitBar visit={visit} axis={axis} ended={ended} silentSince={silentSince} />
          </Fragment>
        ))}
        {silent !== null && (
          <Growing axis={axis} from={silent} className={was ? style.silentOpen : style.silent} />
        )}
      </div>
      <span className={style.state} data-wide={isLong(progress) || undefined}>
        {progress && <LaneState progress={progress} />}
        {waited !== "" && <span className="visually-hidden">, {waited}</span>}
      </span>
    </li>
  );
});

interface LaneToggleProps {
  /** The way to the action, in words. */
  words: string;
  /** Null: nothing is inside; the room for the sign stays. */
  opened: boolean | null;
  onOpen: () => void;
}

export function LaneToggle({ words, opened, onOpen }: LaneToggleProps) {
  if (opened === null) return <span className={style.toggle} />;
  return (
    <button
      type="button"
      className={style.toggle}
      aria-expanded={opened}
      aria-label={`What ran inside of ${words}`}
      onClick={onOpen}
    >
      <IconChevronRight size={14} aria-hidden />
    </button>
  );
}

interface AllLevelsProps {
  lanes: readonly { name: string; holds: boolean }[];
  inside: OpenLanes;
}

/** Toggle for all levels; renders nothing if no lane has inner lanes. */
export function AllLevels({ lanes, inside }: AllLevelsProps) {
  const holding = lanes.filter(({ holds }) => holds);
  if (holding.length === 0) return null;
  const all = holding.every(({ name }) => inside.open.has(name));
  const Icon = all ? IconChevronDown : IconChevronRight;
  return (
    <button
      type="button"
      className={style.openAll}
      aria-expanded={all}
      onClick={() => inside.set(all ? [] : holding.map(({ name }) => name))}
    >
      <Icon size={13} aria-hidden /> All levels
    </button>
  );
}

export interface OpenLanes {
  /** By the names of their actions. */
  readonly open: ReadonlySet<string>;
  readonly toggle: (name: string) => void;
  readonly set: (names: readonly string[]) => void;
}

export function useOpenLanes(): OpenLanes {
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set());
  const toggle = useCallback(
    (name: string) =>
      setOpen((before) => {
        const now = new Set(before);
        if (!now.delete(name)) now.add(name);
        return now;
      }),
    [],
  );
  const set = useCallback((names: readonly string[]) => setOpen(new Set(names)), []);
  return useMemo(() => ({ open, toggle, set }), [open, toggle, set]);
}
