/**
 * Finds keys that two people set without knowing of each other, so that a person can choose between the values.
 *
 * One of the two values stands, by the clocks of Yjs and not by the time. There are two cases:
 *
 * - `return`: this person comes back with edits that nobody has seen, and others changed the same meanwhile.
 * - `unseen`: a value of this person was stored for some seconds, and then an edit replaces it whose author had
 *   not received it. Yjs knows that for certain: an item names the one that its author saw in its place.
 *
 * Where one side deleted an action that the other worked on, the choice is about the action as a whole. A
 * choice is an ordinary edit.
 */

import * as Y from "yjs";
import { deviceNow } from "../clock/server-clock";
import { endsOf, mapsFrom, ROOTS, type Root, rootOf, splitKey } from "../graph/document-keys";
import { asOneEdit } from "../graph/edit/document-writes";
import { lostValue } from "../graph/edit/undo-history";
import { isEqual } from "../graph/values";
import type { ChangedTwice, ReplacedEntries, StoredCopy, UnsavedEdit } from "./indexed-db";
import { type DocumentDifference, strandedEditsIn } from "./replaced-history";

type Compared = Omit<ChangedTwice, "since" | "cause">;

/** One step of the log of a graph. */
interface LoggedStep {
  readonly seq: number;
  readonly author: string;
  readonly root: Root;
  readonly key: string;
  readonly after: unknown;
  /** The value that the step brought, where another one overwrote it at once. */
  readonly overwritten?: unknown;
}

/** Returns the choice with the value that others than `me` set last, by the log; null where it has none of them. */
export function asLogged(
  twice: ChangedTwice,
  steps: readonly LoggedStep[],
  me: string,
): ChangedTwice | null {
  const { root, key, since, writes } = twice;
  const last = steps.findLast(
    (step) => step.root === root && step.key === key && step.author !== me && step.seq > since,
  );
  if (last === undefined) return null;
  const theirs = last.overwritten ?? last.after ?? undefined;
  return { ...twice, theirs, writes: { ...writes, theirs: [[root, key, theirs]] } };
}

/** A change of one key by somebody else, as the page applied it. */
interface Theirs {
  readonly root: Root;
  readonly key: string;
  /** Null where the value is not known: it was collected, or it is a shared type. */
  readonly held: { readonly value: unknown } | null;
  /** True if this value stands now; false if it lost against the value of this page. */
  readonly stands: boolean;
  /** The value that the page showed before. */
  readonly before: unknown;
  /** True if it replaced a stored value of this person that its author had not received. */
  readonly unseen: boolean;
}

/**
 * An edit that is not stored by then was made while away, whether or not the socket has noticed. A stored value
 * that somebody does not know by then was not received by them: they were away, or their network is slow.
 */
const AWAY_MS = 2_000;
const NONE: readonly ChangedTwice[] = [];
const NOTHING: DocumentDifference = mapsFrom({});
const placeOf = (root: Root, key: string) => `${root} ${key}`;

/** The clocks up to which this person's items are stored, and since when, by client id. */
class StoredItems {
  private readonly clocks = new Map<number, { readonly clock: number; readonly at: number }[]>();

  add(client: number, clock: number, at: number): void {
    const all = this.clocks.get(client) ?? [];
    // Only the newest of the old enough entries counts.
    const old = all.findLastIndex((each) => each.at <= deviceNow() - AWAY_MS);
    this.clocks.set(client, [...all.slice(Math.max(old, 0)), { clock, at }]);
  }

  get isEmpty(): boolean {
    return this.clocks.size === 0;
  }

  /** Returns true if this person made the item and it was stored at least `AWAY_MS` ago. */
  has({ id }: Y.Item): boolean {
    const before = deviceNow() - AWAY_MS;
    const all = this.clocks.get(id.client) ?? [];
    return all.some(({ clock, at }) => clock > id.clock && at <= before);
  }
}

export class ChangedTwiceStore {
  private readonly doc: Y.Doc;
  private readonly listeners = new Set<() => void>();
  private found: readonly ChangedTwice[] = NONE;
  /** The ids of choices that were made and are still shown. */
  private readonly chosen = new Set<string>();
  private waiting: ReadonlySet<UnsavedEdit> = new Set();
  private readonly stored = new StoredItems();
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

  /** Takes over what an earlier visit left; called when the document holds the durable edits and no others. */
  restore({ choices = NONE, clients = [] }: Pick<StoredCopy, "choices" | "clients">): void {
    for (const client of clients) {
      const clock = Y.getState(this.doc.store, client);
      if (clock > 0) this.stored.add(client, clock, Number.NEGATIVE_INFINITY);
    }
    const ids = new Set(this.found.map(({ id }) => id));
    if (choices.length > 0) this.tell([...choices.filter(({ id }) => !ids.has(id)), ...this.found]);
  }

  /** The server has stored these edits of this person. */
  durable(edits: readonly UnsavedEdit[]): void {
    for (const { update } of edits) {
      for (const [client, clock] of Y.parseUpdateMeta(update).to) {
        this.stored.add(client, clock, deviceNow());
      }
    }
  }

  /** Called when the page is back, with its own edits that nobody has received yet. */
  back(waiting: readonly UnsavedEdit[]): void {
    this.waiting = new Set(waiting);
    this.own = waiting.length === 0 ? null : strandedEditsIn(this.doc, waiting);
  }

  /** Takes something of others after the entry `since` of the log by `apply`, and looks at what it does to the
   * edits that are still `unsaved`. */
  take(unsaved: readonly UnsavedEdit[], since: number, apply: () => void): void {
    const { doc } = this;
    if (this.own === null || !unsaved.some((edit) => this.waiting.has(edit))) {
      const late = deviceNow() - AWAY_MS;
      this.back(unsaved.filter(({ at }) => at < late));
    }
    const { own, stored } = this;
    if (own === null && stored.isEmpty) {
      apply();
      return;
    }
    const theirs: Theirs[] = [];
    const watched = ROOTS.map((root) => {
      const see = (event: Y.YMapEvent<unknown>) => theirs.push(...whatTheyDid(root, event, stored));
      rootOf(doc, root).observe(see);
      return () => rootOf(doc, root).unobserve(see);
    });
    try {
      apply();
    } finally {
      for (const stop of watched) stop();
    }
    const back = own === null ? [] : compared(doc, own.difference, own.before, theirs);
    const known = new Set(back.map(({ id }) => id));
    const unseen = replacedUnseen(doc, own?.difference ?? NOTHING, theirs, stored);
    const fresh = [
      ...back.map((each) => ({ ...each, since, cause: "return" as const })),
      ...unseen
        .filter(({ id }) => !known.has(id))
        .map((each) => ({ ...each, since, cause: "unseen" as const })),
    ];
    if (fresh.length === 0) return;
    const ids = new Set(fresh.map(({ id }) => id));
    for (const id of ids) this.chosen.delete(id);
    this.tell([...this.found.filter(({ id }) => !ids.has(id)), ...fresh]);
  }

  /** The choices that are still to be made: those of `now` without the ones made on this page. */
  undecided(): readonly ChangedTwice[] {
    return this.found.filter(({ id }) => !this.chosen.has(id));
  }

  /** Writes one of the two values, as an edit of this person. */
  choose({ id, writes }: ChangedTwice, side: "mine" | "theirs"): void {
    asOneEdit(this.doc, () => {
      for (const [root, key, value] of writes[side] ?? []) {
        const map = rootOf(this.doc, root);
        if (value === undefined) map.delete(key);
        else if (!isEqual(map.get(key), value)) map.set(key, value);
      }
    });
    this.chosen.add(id);
    this.tell(this.found);
  }

  /** Returns the side whose value stands now; null where another value does by now. */
  stands({ root, key, mine, theirs }: ChangedTwice): "mine" | "theirs" | null {
    const now = rootOf(this.doc, root).get(key);
    if (isEqual(now, mine)) return "mine";
    return isEqual(now, theirs) ? "theirs" : null;
  }

  /** Closes the list: the person has seen all choices. */
  dismiss(): void {
    this.tell(NONE);
  }

  private tell(found: readonly ChangedTwice[]): void {
    this.found = found;
    for (const listener of [...this.listeners]) listener();
  }
}

function whatTheyDid(root: Root, event: Y.YMapEvent<unknown>, stored: StoredItems): Theirs[] {
  return [...event.keysChanged].flatMap((key): Theirs[] => {
    const now = event.target.get(key);
    const change = event.changes.keys.get(key);
    if (change !== undefined) {
      const unseen = change.action !== "add" && isUnseen(event, key, stored);
      return [{ root, key, held: plain(now), stands: true, before: change.oldValue, unseen }];
    }
    const lost = lostValue(event, key);
    if (lost === null) return [];
    const held = lost.held && plain(lost.held.value);
    return [{ root, key, held, stands: false, before: now, unseen: false }];
  });
}

const isErased = ({ held, stands }: Theirs) => stands && held !== null && held.value === undefined;

/** Shared types, which no page of ours writes, cannot be kept on the device nor written again. */
function plain(value: unknown): Theirs["held"] {
  return value instanceof Y.AbstractType ? null : { value };
}

/**
 * Tells whether the key showed a stored item of this person, and the item that replaced it was made without it.
 *
 * The items of a key stand in one line, and a new one names the last one that its author saw. So the author of
 * the newest item has not seen ours if the way along those names passes ours by.
 */
function isUnseen(event: Y.YMapEvent<unknown>, key: string, stored: StoredItems): boolean {
  const { transaction, target } = event;
  const isNew = ({ id }: Y.Item) => id.clock >= (transaction.beforeState.get(id.client) ?? 0);
  let item = target._map.get(key) ?? null;
  if (item === null || !isNew(item)) return false; // it was only erased
  let { origin } = item;
  for (item = item.left; item !== null && isNew(item); item = item.left) {
    if (origin !== null && holds(item, origin)) origin = item.origin;
  }
  return item !== null && stored.has(item) && (origin === null || !holds(item, origin));
}

function holds({ id, length }: Y.Item, { client, clock }: Y.ID): boolean {
  return id.client === client && clock >= id.clock && clock < id.clock + length;
}

/**
 * Returns choices about stored values of this person that were replaced by edits whose authors had not received
 * them.
 */
function replacedUnseen(
  doc: Y.Doc,
  waiting: DocumentDifference,
  theirs: readonly Theirs[],
  stored: StoredItems,
): Compared[] {
  if (stored.isEmpty) return [];
  const wholes = deletedByThem(leftBehind(doc, theirs, stored), theirs);
  const decided = new Set(wholes.map(({ key }) => key));
  const fields = theirs.flatMap(({ root, key, held, before, unseen }): Compared[] => {
    if (!unseen || waiting[root].has(key) || isEqual(held?.value, before)) return [];
    if (before instanceof Y.AbstractType || ownersOf(root, key).some((aid) => decided.has(aid))) {
      return [];
    }
    const writes = {
      mine: [[root, key, before]] as const,
      theirs: held && ([[root, key, held.value]] as const),
    };
    return [{ id: placeOf(root, key), root, key, mine: before, theirs: held?.value, writes }];
  });
  return [...wholes, ...fields];
}

/**
 * Returns the keys of this person in actions that were just deleted, with empty values. Whoever deletes an action
 * erases all that they see of it, so they had not seen these.
 */
function leftBehind(
  doc: Y.Doc,
  theirs: readonly Theirs[],
  stored: StoredItems,
): DocumentDifference {
  const gone = new Set(theirs.filter(isErased).map(({ key }) => key));
  if (gone.size === 0) return NOTHING;
  const unseenIn = (root: Root) => {
    const left = [...rootOf(doc, root)._map].flatMap(([key, item]) =>
      !item.deleted && ownersOf(root, key).some((aid) => gone.has(aid)) && stored.has(item)
        ? [key]
        : [],
    );
    const replaced = theirs.filter((each) => each.root === root && each.unseen);
    return Object.fromEntries([...left, ...replaced.map(({ key }) => key)].map((key) => [key, ""]));
  };
  return mapsFrom(Object.fromEntries(ROOTS.map((root) => [root, unseenIn(root)])));
}

function compared(
  doc: Y.Doc,
  mine: DocumentDifference,
  before: DocumentDifference,
  theirs: readonly Theirs[],
): Compared[] {
  const wholes = [...deletedByThem(mine, theirs), ...deletedHere(doc, mine, before, theirs)];
  const decided = new Set(wholes.map(({ key }) => key));
  const fields = theirs.flatMap(({ root, key, held, stands }): Compared[] => {
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

/** Returns choices about actions that somebody else deleted and that this person had worked on. */
function deletedByThem(mine: DocumentDifference, theirs: readonly Theirs[]): Compared[] {
  const worked = new Set(
    ROOTS.flatMap((root) => [...mine[root].keys()].flatMap((key) => ownersOf(root, key))),
  );
  const erased = theirs.filter(isErased);
  return erased.flatMap(({ root, key: aid, before: name }): Compared[] => {
    if (root !== "actions" || splitKey(aid).rest !== "" || !worked.has(aid)) return [];
    const back = erased
      .filter((each) => ownersOf(each.root, each.key).includes(aid) && plain(each.before) !== null)
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

/** Returns choices about actions that this person deleted and that somebody else had worked on. */
function deletedHere(
  doc: Y.Doc,
  mine: DocumentDifference,
  before: DocumentDifference,
  theirs: readonly Theirs[],
): Compared[] {
  const worked = new Set(theirs.flatMap(({ root, key }) => ownersOf(root, key)));
  return [...mine.actions].flatMap(([aid, value]): Compared[] => {
    if (value !== undefined || splitKey(aid).rest !== "" || !worked.has(aid)) return [];
    if (rootOf(doc, "actions").has(aid)) return []; // they have set its name, which stands
    const back: ReplacedEntries = ROOTS.flatMap((root) =>
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

/** Returns the ids of the actions that a key belongs to: one, or both ends of an arrow. */
function ownersOf(root: Root, key: string): readonly string[] {
  if (root === "actions" || root === "positions") return [splitKey(key).head];
  if (root !== "relations") return [];
  const ends = endsOf(splitKey(key).head);
  return ends === null ? [] : [ends.parent, ends.child];
}
