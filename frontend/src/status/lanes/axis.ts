/** The time axis of lanes: how long it is, where a moment stands on it, and its ticks. Pure. */

export interface TimeAxis {
  /** When the run began, ms. */
  readonly start: number;
  /** ms. */
  readonly span: number;
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

/** Where a moment stands, 0 to 1. */
export function shareOf(axis: TimeAxis, at: number): number {
  return Math.min(1, Math.max(0, (at - axis.start) / axis.span));
}

/** How many times what grows is drawn while it passes a whole axis: steps of some px. */
const DRAWINGS = 120;
const RENEWALS = [1000, 500]; // ms

/** ms between two drawings of what moves along an axis; each has the page order all its layers. */
export function renewalOf({ span }: TimeAxis): number {
  return RENEWALS.find((each) => each * DRAWINGS <= span) ?? 250;
}

const TICKS = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600]; // s
const MOST_TICKS = 8;

/** ms since the start of each tick. */
export function ticksOf(span: number): number[] {
  const step = (TICKS.find((each) => span / 1000 / each <= MOST_TICKS) ?? 7200) * 1000;
  return Array.from({ length: Math.floor(span / step) + 1 }, (_, i) => i * step);
}
