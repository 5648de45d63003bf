/** Visits as bars on a time axis: where they went on for certain, and where they may have. Pure. */
import type { Visit } from "../../api/runs";
import { instant } from "../../ui/times";
import { type Tone, visitBegin, visitEnd } from "../progress";
import { shareOf, type TimeAxis } from "./axis";

/** Shares of the axis, 0 to 1. */
interface BarSpan {
  readonly left: number;
  readonly width: number;
}

export interface Bar {
  /** Where it went on for certain; null where no such moment is known. */
  readonly sure: BarSpan | null;
  readonly tone: Tone;
  /** It goes on, and the bar with it. */
  readonly open: boolean;
  /** Where it may have gone on as well: nobody saw its ends. */
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

/** `until`: as far as anything is known of the run, ms. */
export function barOf(visit: Visit, axis: TimeAxis, until: number, over: boolean): Bar | null {
  const from = visitBegin(visit);
  if (from === null) return null;
  const end = visitEnd(visit);
  const open = end === null;
  const to = end ?? until;
  const at = (moment: number) => shareOf(axis, moment);
  const earliest = instant(visit.not_before) ?? from;
  const latest = open ? to : (instant(visit.not_after) ?? until);
  const wider = at(latest) - at(earliest) - Math.max(0, at(to) - at(from)) > LEAST;
  return {
    sure:
      to > from || !wider ? { left: at(from), width: Math.max(LEAST, at(to) - at(from)) } : null,
    tone: toneOf(visit, open, over),
    open: open && !over,
    maybe: wider ? { left: at(earliest), width: at(latest) - at(earliest) } : null,
  };
}
