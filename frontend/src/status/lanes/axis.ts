/** The time axis of lanes: how long it is, which part of it is shown, where a moment stands on it, its ticks. Pure. */

import { type RefObject, useLayoutEffect } from "react";
import type { Visit } from "../../api/runs";
import { serverNow } from "../../clock/server-clock";
import { instant } from "../../ui/times";
import { type Tone, visitBegin, visitEnd } from "../progress";

export interface TimeAxis {
  /** The first moment that is shown, ms. */
  readonly start: number;
  /** ms. */
  readonly span: number;
  /** Start of the run, ms; set where a part of the run is shown, and what is outside of it is not. */
  readonly origin?: number;
  /** From the clock of the run, by which the axis goes, to that of the page, ms. */
  readonly shift?: number;
}

/** Return the present by the clock of an axis, ms. */
export const presentOf = ({ shift = 0 }: TimeAxis): number => serverNow() - shift;

/** A part of the time of a run, ms. */
export interface TimeRange {
  readonly from: number;
  readonly until: number;
}

/** The shortest part that is shown, ms: clocks of robots are not better than that. */
const SHORTEST = 1000;
/** Longer than any run, ms. */
const LONGEST = 1e12;

/** Return a part of the time that an address names; null for one that cannot be shown. */
export function rangeOf(from: number, until: number): TimeRange | null {
  const isGood =
    Number.isInteger(from) &&
    until - from >= SHORTEST &&
    until - from < LONGEST &&
    Math.abs(from) < 4 * LONGEST;
  return isGood ? { from, until } : null;
}

/** Return the axis of a part of what an axis shows; `null`, and a part that is not on it, is the whole. */
export function partOf(axis: TimeAxis, range: TimeRange | null): TimeAxis {
  const { start: origin, span } = axis;
  const from = Math.max(range?.from ?? origin, origin);
  const length = Math.min(range?.until ?? origin + span, origin + span) - from;
  return length > 0 && length < span ? { ...axis, start: from, span: length, origin } : axis;
}

/** Return the start of the run, ms, from which the moments of an axis are counted. */
export function originOf(axis: TimeAxis): number {
  return axis.origin ?? axis.start;
}

/**
 * Return the part of `whole` that is `factor` times as long, with the moment `around` at the same place;
 * null for all of it.
 */
export function zoomed(
  range: TimeRange | null,
  whole: TimeAxis,
  around: number,
  factor: number,
): TimeRange | null {
  const end = whole.start + whole.span;
  const { from, until } = range ?? { from: whole.start, until: end };
  const length = Math.max(SHORTEST, (until - from) * factor);
  if (length >= whole.span) return null;
  const share = (Math.min(until, Math.max(from, around)) - from) / (until - from);
  const wanted = from + share * (until - from - length);
  const begin = Math.round(Math.min(end - length, Math.max(whole.start, wanted)));
  return { from: begin, until: Math.round(begin + length) };
}

/** Return a part of the same length that holds a moment, like the page of a book. */
export function turnedTo(range: TimeRange, at: number): TimeRange {
  if (at >= range.from && at <= range.until) return range;
  const length = range.until - range.from;
  const from = range.from + Math.floor((at - range.from) / length) * length;
  return { from, until: from + length };
}

/** Return whether a time that begins and ends at these moments, ms, is on an axis at least in part. */
export function isOn({ start, span, origin }: TimeAxis, begin: number, end = begin): boolean {
  return origin === undefined || (end >= start && begin <= start + span);
}

const STEPS = [10, 20, 30, 60, 90, 120, 180, 300, 600, 900, 1800, 3600]; // s

/**
 * The length of an axis that holds `elapsed` ms of something that goes on. It grows in steps: what has
 * ended stays where it is drawn meanwhile.
 */
export function growingSpan(elapsed: number): number {
  const seconds = Math.max(0, elapsed) / 1000;
  const fits = STEPS.find((step) => step >= seconds);
  return (fits ?? Math.ceil(seconds / 3600) * 3600) * 1000;
}

/** The axis of what has ended. */
export function wholeSpan(elapsed: number): number {
  return Math.max(1000, elapsed);
}

/** Return the position of a moment on the axis, 0 to 1. */
export function shareOf(axis: TimeAxis, at: number): number {
  return Math.min(1, Math.max(0, (at - axis.start) / axis.span));
}

/** Number of steps in which a growing bar is drawn over a whole axis: some px each. */
const DRAWINGS = 120;
const RENEWALS = [1000, 500]; // ms

/** ms between two drawings of what moves along an axis; each has the page order all its layers. */
export function renewalOf({ span }: TimeAxis): number {
  return RENEWALS.find((each) => each * DRAWINGS <= span) ?? 250;
}

const TICKS = [0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600]; // s
const MOST_TICKS = 8;

/** Return the ticks of an axis, ms after the start of the run. */
export function ticksOf(axis: TimeAxis): number[] {
  const { start, span } = axis;
  const step = (TICKS.find((each) => span / 1000 / each <= MOST_TICKS) ?? 7200) * 1000;
  const from = start - originOf(axis);
  const first = Math.ceil(from / step);
  const count = Math.floor((from + span) / step) - first + 1;
  return Array.from({ length: count }, (_, i) => (first + i) * step);
}

/** Shares of the axis, 0 to 1. */
interface BarSpan {
  readonly left: number;
  readonly width: number;
}

export interface Bar {
  /** The span in which the visit certainly went on; null if no such moment is known. */
  readonly sure: BarSpan | null;
  readonly tone: Tone;
  /** Set while the visit goes on, so that the bar grows. */
  readonly open: boolean;
  /** The span in which it may have gone on as well, since its ends were not seen. */
  readonly maybe: BarSpan | null;
}

const RESULTS: ReadonlySet<string> = new Set(["true", "false", "error", "stopped"]);
const LEAST = 0.004; // of the axis; what is shorter could not be seen

function toneOf(visit: Visit, open: boolean, over: boolean): Tone {
  const result = visit.result?.replace(/^on_/, "");
  if (result !== undefined && RESULTS.has(result)) return result as Tone;
  if (!open) return "done";
  return over ? "unknown" : "run";
}

/** Return the bar of a visit on an axis; null if it lies outside. `until`: as far as the run is known, ms. */
export function barOf(visit: Visit, axis: TimeAxis, until: number, over: boolean): Bar | null {
  const from = visitBegin(visit);
  if (from === null) return null;
  const end = visitEnd(visit);
  const open = end === null;
  const to = end ?? until;
  const at = (moment: number) => shareOf(axis, moment);
  const earliest = instant(visit.not_before) ?? from;
  const latest = open ? to : (instant(visit.not_after) ?? until);
  if (!isOn(axis, Math.min(from, earliest), Math.max(to, latest))) return null;
  const wider = at(latest) - at(earliest) - Math.max(0, at(to) - at(from)) > LEAST;
  return {
    sure:
      isOn(axis, from, to) && (to > from || !wider)
        ? { left: at(from), width: Math.max(LEAST, at(to) - at(from)) }
        : null,
    tone: toneOf(visit, open, over),
    open: open && !over,
    maybe: wider ? { left: at(earliest), width: at(latest) - at(earliest) } : null,
  };
}

/** A moment of the way, as `Element.animate` takes it. `offset`: the share of the axis, 0 to 1. */
export interface Waypoint {
  readonly offset: number;
  readonly transform: string;
}

const across = (share: number) => `translateX(${share * 100}%)`;

/** From the begin of the axis to its end. */
export const WHOLE_WAY: readonly Waypoint[] = [
  { offset: 0, transform: across(0) },
  { offset: 1, transform: across(1) },
];

/** The way of a bar that reaches from a share of the axis to now, within what is right of that share. */
export function growingWay(left: number): Waypoint[] {
  const room = Math.max(LEAST, 1 - left);
  const begun = across(Math.min(1, LEAST / room) - 1);
  return [
    { offset: 0, transform: begun },
    { offset: Math.min(1, left + LEAST), transform: begun },
    { offset: 1, transform: across(0) },
  ];
}

/** Largest error of the time of an animation, ms: it stands still while a computer sleeps. */
const SLACK = 1000;
const LOOK = 1000; // ms

/**
 * Keeps an element where time is on an axis, by a way over all of it. A transform that the page itself
 * changes has the browser order all layers anew, each time; this one it moves alone. All ways over an
 * axis take their steps together.
 */
export function useMoving(
  element: RefObject<HTMLElement | null>,
  axis: TimeAxis,
  way: readonly Waypoint[],
): void {
  useLayoutEffect(() => {
    const moved = element.current?.animate?.(
      way.map((point) => ({ ...point })),
      {
        duration: axis.span,
        easing: `steps(${Math.round(axis.span / renewalOf(axis))})`,
        fill: "both",
      },
    );
    if (moved === undefined) return;
    const since = () => presentOf(axis) - axis.start;
    moved.currentTime = since();
    const looking = setInterval(() => {
      if (Math.abs(Number(moved.currentTime) - since()) > SLACK) moved.currentTime = since();
    }, LOOK);
    return () => {
      clearInterval(looking);
      moved.cancel();
    };
  }, [element, axis, way]);
}
