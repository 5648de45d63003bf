/**
 * Fields that a person changed while away and that somebody else changed meanwhile, too.
 *
 * One value of the two stands when the page is back, by the clocks of Yjs and not by the time, so both are
 * kept for the person to choose. Where one side deleted an action that the other worked on, the choice is
 * about the action as a whole. A choice is an ordinary edit.
 */

import type * as Y from "yjs";
import { deviceNow } from "../clock/server-clock";
import { endsOf, ROOTS, type Root, rootOf, splitKey } from "../graph/document-keys";
import { asOneEdit } from "../graph/edit/document-writes";
import { lostValue } from "../graph/edit/undo-history";
import { isEqual } from "../graph/equal";
import type { UnsavedEdit } from "./indexed-db";
import { type DocumentDifference, strandedEditsIn } from "./replaced-history";

/** Values by key; `undefined` erases. */
type Entries = readonly (readonly [root: Root, key: string, value: unknown])[];

export interface ChangedTwice {
  readonly id: string;
  readonly root: Root;
  readonly key: string;
  /** What this person gave it; `undefined` where they deleted it. */
  readonly mine: unknown;
  readonly theirs: unknown;
  /** What to write for each choice; null where the value is not known any more. */
  readonly writes: { readonly mine: Entries; readonly theirs: Entries | null };
}

/** What somebody else did to one key. */
interface Theirs {
  readonly root: Root;
  readonly key: string;
  readonly held: { readonly value: unknown } | null;
  /** Whether it is what stands now. */
  readonly stands: boolean;
  /** What was there before, as the page showed it. */
  readonly before: unknown;
}

/** An edit that is not stored by then was made while away, whether or not the socket has noticed. */
const AWAY_MS = 2_000;
const NONE: readonly ChangedTwice[] = [];
const placeOf = (root: Root, key: string) => `${root} ${key}`;

export class ChangedTwiceStore {
  private readonly doc: Y.Doc;
  private readonly listeners = new Set<() => void>();
  private found: readonly ChangedTwice[] = NONE;
  private waiting: ReadonlySet<UnsavedEdit> = new Set();
  private own: {
    readonly difference: DocumentDifference;
    readonly before: DocumentDifference;
  } | null = null;

  constructor(doc: Y.Doc) {
    this.doc = doc;
  }

  // Bound, so that they can be handed to `useSyncExternalStore`.
  readonly now = (): readonly ChangedTwice[] => this.found;

  readonly onChange = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  /** The page is back with these edits, which nobody has seen yet. */
  back(waiting: readonly UnsavedEdit[]): void {
    this.waiting = new Set(waiting);
    this.own = waiting.length === 0 ? null : strandedEditsIn(this.doc, waiting);
  }

  /** Takes something of others by `apply`, and looks at what it does to the edits that are still `unsaved`. */
  take(unsaved: readonly UnsavedEdit[], apply: () => void): void {
    const { doc } = this;
    if (this.own === null || !unsaved.some((edit) => this.waiting.has(edit))) {
      const late = deviceNow() - AWAY_MS;
      this.back(unsaved.filter(({ at }) => at < late));
    }
    const { own } = this;
    if (own === null) {
      apply();
      return;
    }
    const theirs: Theirs[] = [];
    const watched = ROOTS.map((root) => {
      const see = (event: Y.YMapEvent<unknown>) => theirs.push(...whatTheyDid(root, event));
      rootOf(doc, root).observe(see);
      return () => rootOf(doc, root).unobserve(see);
    });
    try {
      apply();
    } finally {
      for (const stop of watched) stop();
    }
    const fresh = compared(doc, own.difference, own.before, theirs);
    if (fresh.length === 0) return;
    const ids = new Set(fresh.map(({ id }) => id));
    this.tell([...this.found.filter(({ id }) => !ids.has(id)), ...fresh]);
  }

  /** Writes one of the two values, as an edit of this person. */
  choose({ writes }: ChangedTwice, side: "mine" | "theirs"): void {
    asOneEdit(this.doc, () => {
      for (const [root, key, value] of writes[side] ?? []) {
        const map = rootOf(this.doc, root);
        if (value === undefined) map.delete(key);
        else if (!isEqual(map.get(key), value)) map.set(key, value);
      }
    });
  }

  /** Which of the two stands now; null where it is something else by now. */
  stands({ root, key, mine, theirs }: ChangedTwice): "mine" | "theirs" | null {
    const now = rootOf(this.doc, root).get(key);
    if (isEqual(now, mine)) return "mine";
    return isEqual(now, theirs) ? "theirs" : null;
  }

  /** The person has seen all of them. */
  dismiss(): void {
    this.tell(NONE);
  }

  private tell(found: readonly ChangedTwice[]): void {
    this.found = found;
    for (const listener of [...this.listeners]) listener();
  }
}

function whatTheyDid(root: Root, event: Y.YMapEvent<unknown>): Theirs[] {
  return [...event.keysChanged].flatMap((key): Theirs[] => {
    const now = event.target.get(key);
    const change = event.changes.keys.get(key);
    if (change !== undefined) {
      return [{ root, key, held: { value: now }, stands: true, before: change.oldValue }];
    }
    const lost = lostValue(event, key);
    return lost === null ? [] : [{ root, key, held: lost.held, stands: false, before: now }];
  });
}

function compared(
  doc: Y.Doc,
  mine: DocumentDifference,
  before: DocumentDifference,
  theirs: readonly Theirs[],
): ChangedTwice[] {
  const wholes = [...deletedByThem(mine, theirs), ...deletedHere(doc, mine, before, theirs)];
  const decided = new Set(wholes.map(({ key }) => key));
  const fields = theirs.flatMap(({ root, key, held, stands }): ChangedTwice[] => {
    if (!mine[root].has(key) || ownersOf(root, key).some((aid) => decided.has(aid))) return [];
    const own = mine[root].get(key);
    // A value that is not known, and nothing here: they have deleted it again, else it would be seen.
    const isSame = held === null ? own === undefined : isEqual(own, held.value);
    const isOld = !stands && held !== null && isEqual(held.value, before[root].get(key));
    if (isSame || isOld) return [];
    const writes = {
      mine: [[root, key, own]] as const,
      theirs: held && ([[root, key, held.value]] as const),
    };
    return [{ id: placeOf(root, key), root, key, mine: own, theirs: held?.value, writes }];
  });
  return [...wholes, ...fields];
}

/** Actions that somebody else deleted and that this person had worked on. */
function deletedByThem(mine: DocumentDifference, theirs: readonly Theirs[]): ChangedTwice[] {
  const worked = new Set(
    ROOTS.flatMap((root) => [...mine[root].keys()].flatMap((key) => ownersOf(root, key))),
  );
  const erased = theirs.filter(({ held, stands }) => stands && held?.value === undefined);
  return erased.flatMap(({ root, key: aid, before: name }): ChangedTwice[] => {
    if (root !== "actions" || splitKey(aid).rest !== "" || !worked.has(aid)) return [];
    const back = erased
      .filter((each) => ownersOf(each.root, each.key).includes(aid))
      .map((each) => [each.root, each.key, each.before] as const);
    const gone = back.map(([of, key]) => [of, key, undefined] as const);
    return [
      {
        id: placeOf("actions", aid),
        ...{ root, key: aid, mine: name, theirs: undefined },
        writes: { mine: back, theirs: gone },
      },
    ];
  });
}

/** Actions that this person deleted and that somebody else had worked on. */
function deletedHere(
  doc: Y.Doc,
  mine: DocumentDifference,
  before: DocumentDifference,
  theirs: readonly Theirs[],
): ChangedTwice[] {
  const worked = new Set(theirs.flatMap(({ root, key }) => ownersOf(root, key)));
  return [...mine.actions].flatMap(([aid, value]): ChangedTwice[] => {
    if (value !== undefined || splitKey(aid).rest !== "" || !worked.has(aid)) return [];
    if (rootOf(doc, "actions").has(aid)) return []; // they have set its name, which stands
    const back: Entries = ROOTS.flatMap((root) =>
      [...mine[root].keys()]
        .filter((key) => ownersOf(root, key).includes(aid) && !rootOf(doc, root).has(key))
        .map((key) => [root, key, before[root].get(key)] as const),
    );
    const gone = back.map(([root, key]) => [root, key, undefined] as const);
    return [
      {
        id: placeOf("actions", aid),
        ...{ root: "actions", key: aid, mine: undefined, theirs: before.actions.get(aid) },
        writes: { mine: gone, theirs: back },
      },
    ];
  });
}

/** The actions that a key belongs to. */
function ownersOf(root: Root, key: string): readonly string[] {
  if (root === "actions" || root === "positions") return [splitKey(key).head];
  if (root !== "relations") return [];
  const ends = endsOf(splitKey(key).head);
  return ends === null ? [] : [ends.parent, ends.child];
}
