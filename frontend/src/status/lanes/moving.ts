/** What moves along a time axis with time: in small steps that the browser takes without the page. */

import { type RefObject, useLayoutEffect } from "react";
import { serverNow } from "../../clock/server-clock";
import { renewalOf, type TimeAxis } from "./axis";

/** A moment of the way, as `Element.animate` takes it. `offset`: the share of the axis, 0 to 1. */
export interface Waypoint {
  readonly offset: number;
  readonly transform: string;
}

const LEAST = 0.004; // of the axis; what is shorter could not be seen

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

/** How far the time of an animation may be off, ms: it stands still while a computer sleeps. */
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
    const since = () => serverNow() - axis.start;
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
