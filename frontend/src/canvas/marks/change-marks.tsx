/** Marks on cards, notes and arrows that were added, removed or changed between two moments of a graph. */
import { createContext, type ReactNode, use, useLayoutEffect, useState } from "react";
import { useWatched, Watched } from "../../ui/watched";
import style from "./change-marks.module.css";

export interface ChangeMark {
  readonly change: "added" | "removed" | "changed";
  /** The person who made the last change; null if unknown. */
  readonly by: string | null;
  /** The earlier name; null if it is the same. */
  readonly oldName: string | null;
  /** Earlier values by the name of their row on the card. */
  readonly oldValues: ReadonlyMap<string, string>;
  /** Names of the rows that differ between the two sides, where both are shown. */
  readonly rows?: ReadonlySet<string>;
}

/** Marks by the key of an action or note, or the id of a relation. */
export type ChangeMarks = ReadonlyMap<string, ChangeMark>;

function isSameMap<K, V>(a: ReadonlyMap<K, V>, b: ReadonlyMap<K, V>): boolean {
  return a.size === b.size && [...a].every(([key, value]) => b.get(key) === value);
}

function isSameMark(a: ChangeMark, b: ChangeMark): boolean {
  const [rows, others] = [a.rows ?? NO_ROWS, b.rows ?? NO_ROWS];
  return (
    a.change === b.change &&
    a.by === b.by &&
    a.oldName === b.oldName &&
    isSameMap(a.oldValues, b.oldValues) &&
    rows.size === others.size &&
    [...rows].every((row) => others.has(row))
  );
}

const NO_ROWS: ReadonlySet<string> = new Set();

const NO_MARKS: ChangeMarks = new Map();

/** Return the new marks, in which every mark that equals the one before is the identical old object. */
function keepEqualMarks(before: ChangeMarks, marks: ChangeMarks): ChangeMarks {
  if (marks.size === 0 && before.size === 0) return before;
  return new Map(
    [...marks].map(([key, mark]) => {
      const known = before.get(key);
      return [key, known !== undefined && isSameMark(known, mark) ? known : mark];
    }),
  );
}

const ChangeMarksContext = createContext(new Watched(NO_MARKS));

interface ChangeMarkedProps {
  /** The marks; null while nothing is compared. */
  marks: ChangeMarks | null;
  children: ReactNode;
}

/** Provides the marks of all cards, notes and arrows of one canvas. */
export function ChangeMarked({ marks, children }: ChangeMarkedProps) {
  const [store] = useState(() => new Watched(NO_MARKS));
  useLayoutEffect(() => store.set(keepEqualMarks(store.now(), marks ?? NO_MARKS)), [store, marks]);
  return <ChangeMarksContext value={store}>{children}</ChangeMarksContext>;
}

export const CHANGE_SIGNS = { added: "+", removed: "−", changed: "△" } as const;

/** Return the mark of an action or note (by key) or of a relation (by id); undefined without one. */
export function useChangeMark(key: string): ChangeMark | undefined {
  return useWatched(use(ChangeMarksContext), (marks) => marks.get(key));
}

/** Shows the kind of change and its author. `beside`: leaves room for another tag at the same place. */
export function ChangeTag({ mark, beside = false }: { mark: ChangeMark; beside?: boolean }) {
  const { change, by } = mark;
  return (
    <span className={style.tag} data-change={change} data-beside={beside || undefined}>
      <i aria-hidden>{CHANGE_SIGNS[change]}</i>
      {by === null ? (
        change
      ) : (
        <>
          <span className="visually-hidden">{change} by </span>
          <bdi className="ellipsis">{by}</bdi>
        </>
      )}
    </span>
  );
}

/** Shows only the sign of a change, within the pill of an arrow. */
export function ChangeSign({ mark: { change } }: { mark: ChangeMark }) {
  return (
    <b className={style.sign} data-change={change}>
      <span aria-hidden>{CHANGE_SIGNS[change]}</span>
      <span className="visually-hidden">{change}</span>
    </b>
  );
}
