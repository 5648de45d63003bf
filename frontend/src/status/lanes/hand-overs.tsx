/** Times between the end of an action and the begin of another robot's that waited for it, as lines between lanes. */

import { type RefObject, useLayoutEffect, useRef, useState } from "react";
import type { Run, Visit } from "../../api/runs";
import { instant } from "../../ui/times";
import { boundsText } from "../durations";
import { isOn, shareOf, type TimeAxis } from "./axis";
import type { Lane } from "./lanes";
import style from "./timeline.module.css";

/** One hand-over between two robots: what began after what had ended, by names of lanes. */
export interface HandOver {
  readonly from: string;
  readonly to: string;
  /** The action that was waited for, with its robot. */
  readonly words: string;
  /** Times at which the one was seen to have ended, and the other one to have begun, ms. */
  readonly ended: number;
  readonly began: number;
  /** Bounds of the time between both, ms. */
  readonly least: number;
  readonly most: number;
}

interface End {
  readonly until: number;
  readonly after: number;
}

/** Return when a visit ended; null if that was not seen, or bounded by nothing. */
function endOf(visit: Visit): End | null {
  const [until, after] = [instant(visit.until), instant(visit.not_after)];
  return until === null || after === null ? null : { until, after };
}

/** Return the last end of an action within a time; null if none, or one that is not known. */
function lastEnd(visits: readonly Visit[], after: number, before: number): End | null {
  const within = visits.filter((visit) => {
    const until = instant(visit.until);
    return until !== null && until >= after && until <= before;
  });
  const last = within.at(-1);
  return last === undefined ? null : endOf(last);
}

/**
 * Return the hand-overs to one lane, oldest first: for each of its visits the action that it waited
 * for and that ended last, if that is another robot's. A visit with an end or begin that nothing
 * bounds has none.
 */
function handOversTo(run: Run, lane: Lane): HandOver[] {
  const { needs } = lane;
  if (needs === undefined) return [];
  const visitsOf = (name: string) => run.actions?.[name]?.visits ?? [];
  let before = Number.NEGATIVE_INFINITY;
  return visitsOf(lane.name).flatMap((visit) => {
    const [began, least] = [instant(visit.from), instant(visit.not_before)];
    if (began === null || least === null) return [];
    const ends = needs.parents.map((name) => ({
      name,
      end: lastEnd(visitsOf(name), before, began),
    }));
    before = least;
    if (ends.some(({ end }) => end === null)) return [];
    const last = ends.reduce((a, b) => ((b.end?.until ?? 0) > (a.end?.until ?? 0) ? b : a));
    const other = needs.others.find(({ key }) => key === last.name);
    if (other === undefined || last.end === null) return [];
    const { until, after } = last.end;
    return {
      ...{ from: last.name, to: lane.name, words: other.words },
      ...{ ended: until, began, least: Math.max(0, least - after), most: began - until },
    };
  });
}

export function handOversOf(run: Run, lanes: readonly Lane[]): HandOver[] {
  return lanes.flatMap((lane) => handOversTo(run, lane));
}

const SHORT = 1_000; // ms; below that, single milliseconds count

/** Return the time of a hand-over, such as "16 ms", or "12–40 ms" where only bounds are known. */
export function handOverTime({ least, most }: Pick<HandOver, "least" | "most">): string {
  const [from, to] = [Math.floor(least), Math.ceil(most)];
  if (most >= SHORT) return boundsText({ least: least / 1000, most: most / 1000 }) ?? "";
  if (to - from <= 1) return `${to} ms`;
  return from === 0 ? `≤ ${to} ms` : `${from}–${to} ms`;
}

export function handOverWords(over: HandOver): string {
  return `began ${handOverTime(over)} after ${over.words} had ended`;
}

interface Props {
  overs: readonly HandOver[];
  axis: TimeAxis;
  /** The lanes of the run that are shown. */
  lanes: readonly Lane[];
}

/**
 * Return the middle of the row of each lane, px from the top of the list that `lines` stands in. The
 * rows of another run with lanes of the same names come later in that list.
 */
function useMiddles(lines: RefObject<HTMLElement | null>, lanes: Props["lanes"]) {
  const [middles, setMiddles] = useState<ReadonlyMap<string, number>>(new Map());
  useLayoutEffect(() => {
    const rows = lines.current?.parentElement?.querySelectorAll<HTMLElement>("[data-lane]") ?? [];
    const rowOf = new Map([...rows].reverse().map((row) => [row.dataset.lane, row]));
    const found = lanes.flatMap(({ name }): [string, number][] => {
      const row = rowOf.get(name);
      return row ? [[name, row.offsetTop + row.offsetHeight / 2]] : [];
    });
    setMiddles(new Map(found));
  }, [lines, lanes]);
  return middles;
}

export function HandOverLines({ overs, axis, lanes }: Props) {
  const lines = useRef<HTMLLIElement>(null);
  const middles = useMiddles(lines, lanes);
  const newest = new Map(overs.map((over) => [over.to, over]));
  return (
    <li ref={lines} className={style.handOvers} aria-hidden>
      {overs.map((over) => {
        const [from, to] = [middles.get(over.from), middles.get(over.to)];
        if (from === undefined || to === undefined || !isOn(axis, over.ended, over.began))
          return null;
        const [left, right] = [shareOf(axis, over.ended), shareOf(axis, over.began)];
        return (
          <i
            key={`${over.to} ${over.began}`}
            className={style.handOver}
            data-up={to < from || undefined}
            title={handOverWords(over)}
            style={{
              left: `${left * 100}%`,
              width: `${(right - left) * 100}%`,
              top: Math.min(from, to),
              height: Math.abs(to - from),
            }}
          >
            {newest.get(over.to) === over && (
              <b data-side={right < 0.5 ? "right" : "left"}>{handOverTime(over)}</b>
            )}
          </i>
        );
      })}
    </li>
  );
}
