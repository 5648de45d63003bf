/** Durations in words: exact, or between two bounds. */

import type { DurationBounds } from "../api/runs";
import { duration } from "../ui/times";
import type { Progress } from "./progress";

/** Down (or up) to what `duration` can show. */
function shown(ms: number, round: (value: number) => number): number {
  const step = ms < 60_000 ? 100 : 1000;
  return round(Number((ms / step).toFixed(3))) * step;
}

/** Between `least` and `most`, ms; Infinity: nothing bounds it from above. */
function between(least: number, most: number): string {
  const from = duration(shown(least, Math.floor));
  if (most === Number.POSITIVE_INFINITY) return `≥ ${from}`;
  const to = duration(shown(most, Math.ceil));
  if (least < 100) return `≤ ${to}`;
  const unit = from.endsWith(" s") && to.endsWith(" s") ? " s" : "";
  return `${from.slice(0, from.length - unit.length)}–${to}`;
}

const EXACT = 1; // ms

/** Return a duration between two bounds in words; null where nothing is known. */
export function boundsText(took: DurationBounds | null | undefined): string | null {
  if (!took) return null;
  const least = took.least * 1000;
  const most = took.most === null ? Number.POSITIVE_INFINITY : took.most * 1000;
  if (most - least <= EXACT + 1e-6) return duration(most);
  if (most === Number.POSITIVE_INFINITY && least < 100) return null;
  return between(least, most);
}

export function durationText(progress: Pick<Progress, "took" | "atMost">): string | null {
  const { took, atMost } = progress;
  if (took === null || (took === 0 && atMost === null)) return null; // seen in one message only
  const most = atMost === null ? took : atMost;
  return boundsText({
    least: took / 1000,
    most: most === Number.POSITIVE_INFINITY ? null : most / 1000,
  });
}

/** Return the duration as a second part of a state label. */
export function durationLabel(progress: Pick<Progress, "took" | "atMost">): { more?: string } {
  const words = durationText(progress);
  return words === null ? {} : { more: words };
}
