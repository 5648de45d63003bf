/** Marks on cards and arrows that have changed since a run last went well. */
import type { ComponentType } from "react";
import { useWatched, Watched } from "../../ui/watched";

export interface SinceMark {
  readonly change: "added" | "changed";
  /** The difference in words, such as `speed 0.4 → 0.9`; empty for what was added. */
  readonly words: string;
  /** Names of the changed fields, as the history has them. */
  readonly fields: readonly string[];
}

export interface SinceMarks {
  readonly graph: string;
  readonly run: number;
  /** The moment (`seq`) at which that run was started. */
  readonly seq: number;
  /** Marks by action key or relation id. Equal marks keep their identity. */
  readonly marks: ReadonlyMap<string, SinceMark>;
  /** The component that draws a mark; it is loaded together with the marks. */
  readonly Sign: ComponentType<SinceSignProps>;
}

export interface SinceSignProps {
  readonly of: string;
  readonly on: "card" | "arrow";
  readonly mark: SinceMark;
  readonly since: SinceMarks;
}

/**
 * The page has one canvas, hence one store; cards and arrows subscribe to their own marks. Null:
 * nothing is marked.
 */
export const sinceMarks = new Watched<SinceMarks | null>(null);

/** Draws the mark of an action or arrow, if it has one. */
export function SinceSpot({ of, on }: Pick<SinceSignProps, "of" | "on">) {
  const mark = useWatched(sinceMarks, (since) => since?.marks.get(of));
  const since = sinceMarks.now();
  return mark && since && <since.Sign {...{ of, on, mark, since }} />;
}
