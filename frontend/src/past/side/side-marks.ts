/** Marks on two canvases beside each other: each says what it is, and not what the other one shows. Pure. */
import type { ChangeMark, ChangeMarks } from "../../canvas/marks/change-marks";

const NO_VALUES: ReadonlyMap<string, string> = new Map();

/** What came is on the later one only, what went on the earlier one, what changed on both. */
export function sideMarks(marks: ChangeMarks, side: "earlier" | "later"): ChangeMarks {
  const other: ChangeMark["change"] = side === "earlier" ? "added" : "removed";
  const found = [...marks].flatMap(([key, mark]): [string, ChangeMark][] => {
    if (mark.change === other) return [];
    const rows = new Set(mark.oldValues.keys());
    return [[key, { ...mark, oldName: null, oldValues: NO_VALUES, rows }]];
  });
  return new Map(found);
}
