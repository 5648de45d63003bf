/** The course of a run in one bar: when something ran, and how that ended. */
import type { ListedRun } from "../api/review";
import type { Run } from "../api/runs";
import { type Tone, visitBegin, visitEnd } from "../status/progress";
import { toneColor } from "../status/state-label";
import { instant } from "../ui/times";
import style from "./run-list.module.css";

const STEPS = 60;
/** The tones of a step, from the least to the most important one, as `runs/course_bar.py` has them. */
const RANKS = ["idle", "true", "done", "run", "unknown", "false", "stopped", "error"] as const;

interface CoursePart {
  readonly tone: Tone;
  readonly steps: number;
}

/** Return the course of a run by its visits, from `begin` until `end` (ms), as the runner sums up what is over. */
export function courseOf(run: Pick<Run, "actions" | "ended_at">, begin: number, end: number) {
  const steps = new Array<number>(STEPS).fill(0);
  const at = (moment: number) => Math.floor(((moment - begin) * STEPS) / Math.max(1, end - begin));
  const paint = (from: number, until: number, tone: (typeof RANKS)[number]) => {
    const first = Math.min(STEPS - 1, Math.max(0, at(from)));
    const past = Math.min(STEPS, Math.max(first + 1, at(until)));
    for (let i = first; i < past; i += 1) steps[i] = Math.max(steps[i] ?? 0, RANKS.indexOf(tone));
  };
  const open = run.ended_at === null ? "run" : "unknown";
  for (const { older, visits } of Object.values(run.actions ?? {})) {
    const first = visits[0] === undefined ? null : visitBegin(visits[0]);
    if (older > 0 && first !== null) paint(begin, first, "done");
    for (const visit of visits) {
      const [from, until] = [visitBegin(visit), visitEnd(visit)];
      if (from !== null)
        paint(from, until ?? end, visit.result ?? (until === null ? open : "done"));
    }
  }
  const parts: CoursePart[] = [];
  for (const rank of steps) {
    const tone = RANKS[rank] ?? "idle";
    const last = parts.at(-1);
    if (last?.tone === tone) parts[parts.length - 1] = { tone, steps: last.steps + 1 };
    else parts.push({ tone, steps: 1 });
  }
  return parts;
}

function partsOf(run: ListedRun & Pick<Run, "actions">, now: number): readonly CoursePart[] {
  const summed = run.course ?? [];
  if (summed.length > 0) {
    return summed.map(({ shows, steps }) => ({ tone: shows === "none" ? "idle" : shows, steps }));
  }
  const begin = instant(run.started_at);
  if (begin === null || Object.keys(run.actions ?? {}).length === 0) return [];
  return courseOf(run, begin, instant(run.ended_at) ?? now);
}

const WORDS: Partial<Record<Tone, string>> = {
  run: "running",
  done: "ended",
  unknown: "not known",
};

export function CourseBar({ run, now }: { run: ListedRun & Pick<Run, "actions">; now: number }) {
  const parts = partsOf(run, now);
  const told = parts.filter(({ tone }) => tone !== "idle").map(({ tone }) => WORDS[tone] ?? tone);
  if (told.length === 0) return null;
  return (
    <span className={style.bar} role="img" aria-label={`Course: ${told.join(", ")}`}>
      {parts.map(({ tone, steps }, i) => (
        <i
          // biome-ignore lint/suspicious/noArrayIndexKey: parts have no names, only places
          key={i}
          data-tone={tone}
          style={{ flexGrow: steps, background: tone === "idle" ? "none" : toneColor[tone] }}
        />
      ))}
    </span>
  );
}
