/** Problems by the card or arrow at which they are drawn, and the badge that shows their counts. */

import { IconAlertTriangleFilled } from "@tabler/icons-react";
import { otherPlaces, type ProblemGroup } from "../../graph/problems/problem-groups";
import { countsOf, countWords, type ProblemCounts } from "../../graph/problems/problem-kinds";
import style from "./problem-marks.module.css";

/** The counted problems of one card or arrow. */
export interface ProblemMark extends ProblemCounts {
  /** One line for each problem with its code at the end; errors come first. */
  readonly reasons: string;
}

/** Marks by action key or relation id. Problems without a place on the canvas appear in the list only. */
export type ProblemMarks = ReadonlyMap<string, ProblemMark>;

export const NO_PROBLEM_MARKS: ProblemMarks = new Map();

/** Return the marks of all places on the canvas to which errors and warnings refer. Notes get none. */
export function problemMarksOf(told: readonly ProblemGroup[]): ProblemMarks {
  const places = new Map<string, ProblemGroup[]>();
  for (const each of told) {
    if (each.kind === "note") continue; // it would mark the arrows of nearly every graph
    const others = each.problems.flatMap((problem) => otherPlaces(problem));
    for (const place of new Set([each.place, ...others])) {
      if (place === null) continue;
      const known = places.get(place);
      if (known) known.push(each);
      else places.set(place, [each]);
    }
  }
  return new Map(
    [...places].map(([place, list]) => {
      const reasons = list.map(({ message, code }) => `${message} (${code})`).join("\n");
      return [place, { ...countsOf(list), reasons }];
    }),
  );
}

/** Return a mark as the end of an accessible name; empty without a mark. */
export function problemMarkWords(mark: ProblemMark | null | undefined): string {
  if (!mark) return "";
  return `. ${countWords(mark).join(", ")}. ${mark.reasons.replaceAll("\n", " ")}`;
}

/** Shows the counts of a mark, with all messages as a tooltip and for screen readers. */
export function ProblemBadge({ mark, on }: { mark: ProblemMark; on: "card" | "arrow" }) {
  const { wrong, fillIn, warnings } = mark;
  return (
    <span className={style.badges} data-on={on} title={mark.reasons}>
      <span aria-hidden className={style.badges}>
        {wrong > 0 && (
          <span className={style.badge} data-kind="wrong">
            {on === "card" ? `${wrong} wrong` : <IconAlertTriangleFilled size={10} />}
          </span>
        )}
        {fillIn > 0 && (
          <span className={style.badge} data-kind="fill-in">
            {fillIn}
          </span>
        )}
        {wrong === 0 && warnings > 0 && (
          <span className={style.badge} data-kind="warning">
            <IconAlertTriangleFilled size={10} /> {on === "card" && warnings}
          </span>
        )}
      </span>
      <span className="visually-hidden">
        {countWords(mark).join(", ")}. {mark.reasons}
      </span>
    </span>
  );
}
