/** What differs between two moments of a graph, as marks on what is drawn: came, went, or is otherwise. */
import { createContext, use } from "react";

export interface ChangeMark {
  readonly change: "added" | "removed" | "changed";
  /** Who did that last, where it is known. */
  readonly by: string | null;
  /** What the name was; null where it is the same. */
  readonly oldName: string | null;
  /** What values were, by the name of their row on the card. */
  readonly oldValues: ReadonlyMap<string, string>;
  /** The rows on the card that say something else than on the other side, where both are shown. */
  readonly rows?: ReadonlySet<string>;
}

/** By key of an action or note, and by id of a relation. */
export type ChangeMarks = ReadonlyMap<string, ChangeMark>;

export const ChangeMarksContext = createContext<ChangeMarks | null>(null);

export const CHANGE_SIGNS = { added: "+", removed: "−", changed: "△" } as const;

export function useChangeMark(key: string): ChangeMark | undefined {
  return use(ChangeMarksContext)?.get(key);
}
