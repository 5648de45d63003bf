/** What is another thing than when a run last went well, as quiet marks on cards and arrows. */
import { type ComponentType, useSyncExternalStore } from "react";
import { Watched } from "../../ui/watched";

export interface SinceMark {
  readonly change: "added" | "changed";
  /** What it says otherwise, as people know it: `speed 0.4 → 0.9`; "" of what came. */
  readonly words: string;
  /** Which of its fields those are, as the history calls them. */
  readonly fields: readonly string[];
}

export interface SinceMarks {
  readonly graph: string;
  readonly run: number;
  /** The change after which it was started. */
  readonly seq: number;
  /** By key of an action and id of a relation. What is the same again keeps its identity. */
  readonly marks: ReadonlyMap<string, SinceMark>;
  /** What is drawn at them: loaded with the marks. */
  readonly Sign: ComponentType<SinceSignProps>;
}

export interface SinceSignProps {
  readonly of: string;
  readonly on: "card" | "arrow";
  readonly mark: SinceMark;
  readonly since: SinceMarks;
}

/** One for the page: there is one canvas. What is drawn listens for itself, so that little draws again. Null:
 * nothing is marked. */
export const sinceMarks = new Watched<SinceMarks | null>(null);

/** The sign of an action or arrow that is another thing than when a run last went well. */
export function SinceSpot({ of, on }: Pick<SinceSignProps, "of" | "on">) {
  const mark = useSyncExternalStore(sinceMarks.subscribe, () => sinceMarks.now()?.marks.get(of));
  const since = sinceMarks.now();
  return mark && since && <since.Sign {...{ of, on, mark, since }} />;
}
