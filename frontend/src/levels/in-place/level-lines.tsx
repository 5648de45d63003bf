/** The arrows of a graph that is drawn inside of an action: to look at. */
import { memo } from "react";
import { pillWord } from "../../canvas/arrows/bundles";
import { pathOf } from "../../canvas/arrows/line-path";
import { Glyphs, TIPS, toneOf } from "../../canvas/outcome-arrow";
import type { Key, Precondition } from "../../graph/model";
import type { Progress } from "../../status/progress";
import style from "./level-frame.module.css";
import type { LevelLayout } from "./level-layout";

const NOTHING: readonly Precondition[] = [];

interface LevelLineProps {
  of: LevelLayout["lines"][number];
  /** How its parent ended. */
  ended: string | undefined;
}

/** The outcome of the line that came. */
const cameOf = ({ bundle }: LevelLineProps["of"], ended: string | undefined): Precondition | null =>
  bundle.outcomes.find((outcome) => outcome === `on_${ended}`) ?? null;

function Line({ of, ended }: LevelLineProps) {
  const { bundle, line } = of;
  const came = bundle.entry ? null : cameOf(of, ended);
  const tone = toneOf({ bundle, entry: bundle.entry, came });
  return (
    <path
      d={pathOf(line.points)}
      fill="none"
      markerEnd={`url(#tip-${tone})`}
      style={{ stroke: TIPS[tone] }}
      strokeWidth={came === null ? 1.8 : 2.75}
      strokeDasharray={bundle.optional ? "5 4" : undefined}
    />
  );
}

function Pill({ of: { bundle, line } }: Pick<LevelLineProps, "of">) {
  const word = pillWord(bundle);
  if (!line.pill || (word === "" && bundle.outcomes.length === 0)) return null;
  const [left, top] = line.pill;
  return (
    <div className={style.pill} style={{ left, top }}>
      {!bundle.entry && <Glyphs outcomes={bundle.outcomes} untaken={NOTHING} />}
      {word}
    </div>
  );
}

interface Props {
  lines: LevelLayout["lines"];
  progress: ReadonlyMap<Key, Progress>;
}

export const LevelLines = memo(function LevelLines({ lines, progress }: Props) {
  return (
    <>
      <svg className={style.lines} aria-hidden>
        {lines.map((each) => (
          <Line key={each.bundle.id} of={each} ended={progress.get(each.bundle.source)?.tone} />
        ))}
      </svg>
      {lines.map((each) => (
        <Pill key={each.bundle.id} of={each} />
      ))}
    </>
  );
});
