/** Fields with two values, in words. */
import { changesOf, type ValuesByRoot } from "../graph/changes";
import { type Maps, mapsFrom, mapsOf, type Root } from "../graph/document-keys";
import type { ChangedTwice } from "../sync/changed-twice";
import { useGraph, useRoom } from "../sync/use-room";

export interface ToldTwice {
  readonly twice: ChangedTwice;
  /** "Look: Description". */
  readonly title: string;
  readonly mine: string;
  readonly theirs: string;
}

/** In words; null for what no person has changed, such as an order that follows from something else. */
function toldOf(twice: ChangedTwice, here: Maps): ToldTwice | null {
  const { root, key, mine, theirs, writes } = twice;
  const [change] = changesOf(
    { difference: only(root, key, mine), before: only(root, key, theirs), here },
    here,
  );
  const [line] = change?.lines ?? [];
  if (change === undefined || line === undefined) return null;
  const isWhole = writes.mine.length > 1 || (writes.theirs?.length ?? 0) > 1;
  const unknown = "another value, which the history has";
  const nothing = isWhole ? "Deleted" : "Nothing";
  return {
    twice,
    title: isWhole ? change.title : `${change.title}: ${line.field}`,
    mine: line.after ?? nothing,
    theirs: writes.theirs === null ? unknown : (line.before ?? nothing),
  };
}

function only(root: Root, key: string, value: unknown): ValuesByRoot {
  return mapsFrom({ [root]: { [key]: value } });
}

/** What there is to choose from, in words. */
export function useChangedTwiceTold(all: readonly ChangedTwice[]): readonly ToldTwice[] {
  const { doc } = useRoom();
  useGraph(); // the names in it
  if (all.length === 0) return [];
  const here = mapsOf(doc);
  return all.flatMap((twice) => toldOf(twice, here) ?? []);
}
