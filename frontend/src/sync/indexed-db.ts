/**
 * Stores in IndexedDB, for each graph that was open here, a copy to open offline and the edits that no server has
 * stored yet.
 *
 * Everything is kept per graph, epoch and person, so that on a shared tablet nobody's edits are ever
 * sent, or shown, under another name. IndexedDB works without a secure context; where a browser
 * refuses it, each call here rejects, and the room says that nothing is kept.
 */

import { deviceNow } from "../clock/server-clock";
import type { Root } from "../graph/document-keys";

/** The graph and the person whose copy it is. */
export interface CopyOwner {
  readonly graph: string;
  readonly person: { readonly id: string; readonly name: string };
}

/** The values that an edit replaced, by key; `undefined` where there was none. */
export type ReplacedEntries = readonly (readonly [root: Root, key: string, value: unknown])[];

/** An edit that is not durable. Ids sort by the order in which they were made. */
export interface UnsavedEdit {
  readonly id: string;
  readonly update: Uint8Array;
  /** The time, in milliseconds since 1970. */
  readonly at: number;
  /** The values that it replaced; absent where they are not known. */
  readonly before?: ReplacedEntries;
}

/** An edit that was made at this moment. */
export const madeNow = (update: Uint8Array, before: ReplacedEntries): UnsavedEdit => ({
  id: freshId(),
  update,
  at: deviceNow(),
  before,
});

/** A key that this person and somebody else set without knowing of each other. */
export interface ChangedTwice {
  readonly id: string;
  readonly root: Root;
  readonly key: string;
  /** The value that this person set; `undefined` where they deleted it. */
  readonly mine: unknown;
  readonly theirs: unknown;
  /** The entry of the log up to which the page knew what others did. */
  readonly since: number;
  /**
   * `return`: this person was away, and others changed the same meanwhile. `unseen`: the value of this person was
   * stored, and an edit replaced it whose author had not received it.
   */
  readonly cause: "return" | "unseen";
  /** The entries to write for each choice; null where the value is not known any more. */
  readonly writes: { readonly mine: ReplacedEntries; readonly theirs: ReplacedEntries | null };
}

export const idOf = ({ id }: { readonly id: string }): string => id;

export interface StoredCopy {
  /** One history of the graph, see `epochName`. */
  readonly epoch: string;
  /** The copy shows the log up to this entry. */
  readonly seq: number;
  /** Updates that are durable; together they are the document. */
  readonly known: readonly Uint8Array[];
  readonly waiting: readonly UnsavedEdit[];
  /** Values that the person has not chosen between yet. */
  readonly choices?: readonly ChangedTwice[];
  /** The client ids with which this person has edited the graph on this device. */
  readonly clients?: readonly number[];
}

/** One write, which is stored as a whole or not at all. */
export interface StoreWrite {
  readonly waits: readonly UnsavedEdit[];
  readonly known: readonly Uint8Array[];
  /** Edits that waited and are durable now. */
  readonly durable: readonly UnsavedEdit[];
  /** The whole document, which replaces what was known. Only of durable edits. */
  readonly copy: Uint8Array | null;
  readonly seq: number;
  /** Choices to keep from now on, and the ids of those that were made. */
  readonly choices?: { readonly put: readonly ChangedTwice[]; readonly gone: readonly string[] };
  /** The client id of the durable edits. */
  readonly client?: number;
}

/** Another person, with edits that wait on this device until they sign in again. */
export interface OtherPerson {
  readonly id: string;
  readonly name: string;
  readonly waiting: number;
}

/** A graph that opens without a server. */
export interface KeptGraph {
  readonly graph: string;
  /** The time, in milliseconds since 1970. */
  readonly usedAt: number;
  /** The number of edits that are not stored by the server. */
  readonly waiting: number;
}

export interface EditStore {
  /** Returns the copies of all histories of the graph; the last used one is the last. */
  read(owner: CopyOwner): Promise<readonly StoredCopy[]>;
  write(owner: CopyOwner, epoch: string, batch: StoreWrite): Promise<void>;
  /** Deletes these edits (by id), and the copy unless edits of another page wait on it. */
  forget(owner: CopyOwner, epoch: string, edits: readonly string[]): Promise<void>;
  /** The graphs of which this person has a copy here, the last used first. */
  graphs(person: string): Promise<readonly KeptGraph[]>;
  /** Deletes this person's copies in which no edit and no choice waits. */
  leave(person: string): Promise<void>;
  /** The others with edits of this graph that wait here. */
  others(owner: CopyOwner): Promise<readonly OtherPerson[]>;
}

/** The epoch under which a graph is kept until its server has named its history. */
export const UNNAMED_EPOCH = "0";

/** Returns an epoch for a document that begins anew although the server calls the history the same. */
export function newEpoch(name: string): string {
  return `${name || UNNAMED_EPOCH}~${freshId()}`;
}

/**
 * Returns the server's name of the history that is kept under this epoch; empty while the server has not named it.
 */
export function epochName(epoch: string): string {
  const [name = UNNAMED_EPOCH] = epoch.split("~");
  return name === UNNAMED_EPOCH ? "" : name;
}

const NAME = "action-assistant";
/**
 * Copies of graphs in which nothing waits; the least recently used go first.
 *
 * @public e2e/browser-storage.spec.ts builds this module by itself
 */
export const MOST_COPIES = 40;

interface Copy {
  graph: string;
  epoch: string;
  person: string;
  name: string;
  seq: number;
  usedAt: number;
  /** Absent in copies that an older page wrote. */
  choices?: readonly ChangedTwice[];
  clients?: readonly number[];
}

/** The client ids of so many visits are remembered. */
const MOST_CLIENTS = 100;

type CopyKey = readonly [graph: string, person: string, epoch: string];

/**
 * Returns the store of this browser. The database is opened once, at the first call.
 *
 * @public e2e/browser-storage.spec.ts builds this module by itself
 */
export function indexedDbStore(factory: IDBFactory | undefined = globalThis.indexedDB): EditStore {
  let opened: Promise<IDBDatabase> | null = null;
  const database = () => {
    opened ??= openDatabase(factory, () => {
      opened = null;
    });
    opened.catch(() => {
      opened = null;
    });
    return opened;
  };
  return {
    async read(owner) {
      const work = (await database()).transaction(["copies", "known", "waiting"]);
      const range = within(owner.graph, owner.person.id);
      const copies = (await answer(work.objectStore("copies").getAll(range))) as Copy[];
      copies.sort((a, b) => a.usedAt - b.usedAt);
      return Promise.all(copies.map((copy) => readOne(work, copy)));
    },
    async write(owner, epoch, batch) {
      const store = await database();
      try {
        await writeBatch(store, owner, epoch, batch);
      } catch (error) {
        if (!(error instanceof DOMException && error.name === "QuotaExceededError")) throw error;
        await prune(store, owner, 0);
        await writeBatch(store, owner, epoch, batch);
      }
      if (batch.copy !== null) await prune(store, owner, MOST_COPIES);
    },
    async forget(owner, epoch, edits) {
      const work = (await database()).transaction(["copies", "known", "waiting"], "readwrite");
      const done = finished(work);
      const place: CopyKey = [owner.graph, owner.person.id, epoch];
      const waiting = work.objectStore("waiting");
      for (const id of edits) waiting.delete([...place, id]);
      if ((await answer(waiting.count(within(...place)))) === 0) remove(work, place);
      await done;
    },
    async graphs(person) {
      const work = (await database()).transaction(["copies", "waiting"]);
      const copies = (await answer(work.objectStore("copies").getAll())) as Copy[];
      const waiting = await answer(work.objectStore("waiting").getAllKeys());
      return keptOf(copies, waiting as unknown as CopyKey[], person);
    },
    async leave(person) {
      const work = (await database()).transaction(["copies", "known", "waiting"], "readwrite");
      const done = finished(work);
      const copies = (await answer(work.objectStore("copies").getAll())) as Copy[];
      const keys = (await answer(work.objectStore("waiting").getAllKeys())) as unknown as CopyKey[];
      const busy = busyPlaces(copies, keys);
      for (const copy of copies) {
        const place: CopyKey = [copy.graph, copy.person, copy.epoch];
        if (copy.person === person && !busy.has(JSON.stringify(place))) remove(work, place);
      }
      await done;
    },
    async others(owner) {
      const work = (await database()).transaction(["copies", "waiting"]);
      const range = within(owner.graph);
      const keys = (await answer(
        work.objectStore("waiting").getAllKeys(range),
      )) as unknown as CopyKey[];
      const copies = (await answer(work.objectStore("copies").getAll(range))) as Copy[];
      const names = new Map(copies.map((copy) => [copy.person, copy.name]));
      const counts = new Map<string, number>();
      for (const [, person] of keys) {
        if (person !== owner.person.id) counts.set(person, (counts.get(person) ?? 0) + 1);
      }
      return [...counts].map(([id, waiting]) => ({ id, name: names.get(id) ?? "", waiting }));
    },
  };
}

let ofBrowser: EditStore | null = null;

/** Returns the store of this browser, the same for all rooms. */
export function browserStore(): EditStore {
  ofBrowser ??= indexedDbStore();
  return ofBrowser;
}

function openDatabase(factory: IDBFactory | undefined, onLost: () => void): Promise<IDBDatabase> {
  return new Promise((resolve, reject) => {
    if (factory === undefined) throw new Error("This browser stores nothing for this page");
    const request = factory.open(NAME, 1);
    request.onupgradeneeded = () => {
      for (const store of ["copies", "known", "waiting"]) request.result.createObjectStore(store);
    };
    request.onerror = () => reject(request.error);
    request.onblocked = () => reject(new Error("another version of this page holds the storage"));
    request.onsuccess = () => {
      const database = request.result;
      database.onclose = onLost;
      database.onversionchange = () => {
        database.close();
        onLost();
      };
      resolve(database);
    };
  });
}

/** Returns the range of all keys that begin with these parts: an array sorts after every text. */
function within(...parts: readonly string[]): IDBKeyRange {
  return IDBKeyRange.bound([...parts], [...parts, []]);
}

async function readOne(work: IDBTransaction, copy: Copy): Promise<StoredCopy> {
  const range = within(copy.graph, copy.person, copy.epoch);
  const [known, waiting] = await Promise.all([
    answer(work.objectStore("known").getAll(range)) as Promise<Uint8Array[]>,
    answer(work.objectStore("waiting").getAll(range)) as Promise<UnsavedEdit[]>,
  ]);
  const { epoch, seq, choices = [], clients = [] } = copy;
  return {
    ...{ epoch, seq, known, waiting },
    ...(choices.length > 0 && { choices }),
    ...(clients.length > 0 && { clients }),
  };
}

async function writeBatch(
  database: IDBDatabase,
  { graph, person }: CopyOwner,
  epoch: string,
  { waits, known, durable, copy, seq, choices, client }: StoreWrite,
): Promise<void> {
  const work = database.transaction(["copies", "known", "waiting"], "readwrite", {
    durability: "strict",
  });
  const done = finished(work);
  const place: CopyKey = [graph, person.id, epoch];
  const tail = work.objectStore("known");
  const waiting = work.objectStore("waiting");
  if (copy !== null) {
    tail.delete(within(...place));
    tail.put(copy, [...place, freshId()]);
  }
  for (const update of known) tail.put(update, [...place, freshId()]);
  for (const edit of waits) waiting.put(edit, [...place, edit.id]);
  for (const { id, update } of durable) {
    waiting.delete([...place, id]);
    if (copy === null) tail.put(update, [...place, freshId()]);
  }
  const copies = work.objectStore("copies");
  // Another tab writes to the same copy, so the two lists are changed and not replaced.
  const old = (await answer(copies.get([...place]))) as Copy | undefined;
  const changed = new Set([...(choices?.gone ?? []), ...(choices?.put ?? []).map(idOf)]);
  const rest = (old?.choices ?? []).filter(({ id }) => !changed.has(id));
  const clients = new Set([...(old?.clients ?? []), ...(client === undefined ? [] : [client])]);
  const entry: Copy = {
    graph,
    epoch,
    person: person.id,
    name: person.name,
    seq,
    usedAt: deviceNow(),
    choices: [...rest, ...(choices?.put ?? [])],
    clients: [...clients].slice(-MOST_CLIENTS),
  };
  copies.put(entry, [...place]);
  work.commit();
  await done;
}

/** Deletes copies in which no edit and no choice waits, except the newest and the one in use. */
async function prune(database: IDBDatabase, owner: CopyOwner, most: number): Promise<void> {
  const work = database.transaction(["copies", "known", "waiting"], "readwrite");
  const done = finished(work);
  const copies = (await answer(work.objectStore("copies").getAll())) as Copy[];
  const keys = (await answer(work.objectStore("waiting").getAllKeys())) as unknown as CopyKey[];
  const busy = busyPlaces(copies, keys);
  const idle = copies
    .sort((a, b) => b.usedAt - a.usedAt)
    .filter(({ graph, person, epoch }) => {
      const inUse = graph === owner.graph && person === owner.person.id;
      return !inUse && !busy.has(JSON.stringify([graph, person, epoch]));
    });
  for (const { graph, person, epoch } of idle.slice(most)) remove(work, [graph, person, epoch]);
  await done;
}

/** The copies in which an edit or a choice waits. */
function busyPlaces(copies: readonly Copy[], edits: readonly CopyKey[]): ReadonlySet<string> {
  const undecided = copies
    .filter(({ choices }) => (choices?.length ?? 0) > 0)
    .map(({ graph, person, epoch }) => [graph, person, epoch] as const);
  return new Set(
    [...edits, ...undecided].map(([graph, person, epoch]) =>
      JSON.stringify([graph, person, epoch]),
    ),
  );
}

/** Returns each graph once, whatever number of histories is kept of it. */
function keptOf(
  copies: readonly Copy[],
  waiting: readonly CopyKey[],
  person: string,
): readonly KeptGraph[] {
  const found = new Map<string, KeptGraph>();
  for (const { graph, usedAt } of copies.filter((copy) => copy.person === person)) {
    const count = waiting.filter(([of, whose]) => of === graph && whose === person).length;
    const latest = Math.max(usedAt, found.get(graph)?.usedAt ?? 0);
    found.set(graph, { graph, usedAt: latest, waiting: count });
  }
  return [...found.values()].sort((a, b) => b.usedAt - a.usedAt);
}

function remove(work: IDBTransaction, place: CopyKey): void {
  work.objectStore("copies").delete([...place]);
  for (const store of ["known", "waiting"]) work.objectStore(store).delete(within(...place));
}

let made = 0;

/** Returns a unique key that sorts after all earlier ones. Needs no secure context. */
function freshId(): string {
  made += 1;
  const parts = [deviceNow().toString(36).padStart(9, "0"), made.toString(36).padStart(6, "0")];
  return [...parts, Math.random().toString(36).slice(2, 10)].join("-");
}

function answer<T>(request: IDBRequest<T>): Promise<T> {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

function finished(work: IDBTransaction): Promise<void> {
  return new Promise((resolve, reject) => {
    work.oncomplete = () => resolve();
    work.onabort = () => reject(work.error ?? new Error("the write was given up"));
  });
}
