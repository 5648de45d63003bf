/** A device in memory for tests, which can refuse, hang, and lose what was not written yet. */

import type {
  ChangedTwice,
  CopyOwner,
  EditStore,
  StoredCopy,
  StoreWrite,
  UnsavedEdit,
} from "../sync/indexed-db";

interface StoredGraph {
  graph: string;
  person: CopyOwner["person"];
  epoch: string;
  seq: number;
  known: Uint8Array[];
  waiting: Map<string, UnsavedEdit>;
  choices: Map<string, ChangedTwice>;
  clients: number[];
}

export class FakeEditStore implements EditStore {
  readonly entries: StoredGraph[] = [];
  /** While set, every call fails. */
  refuses = false;
  writes = 0;
  /** Resolves reads when it does; a hanging device otherwise. */
  ready: Promise<void> = Promise.resolve();

  async read({ graph, person }: CopyOwner): Promise<readonly StoredCopy[]> {
    await this.ready;
    this.check();
    return this.entries
      .filter((e) => e.graph === graph && e.person.id === person.id)
      .map(({ epoch, seq, known, waiting, choices, clients }) => ({
        epoch,
        seq,
        choices: [...choices.values()],
        clients: [...clients],
        known: [...known],
        waiting: [...waiting.values()],
      }));
  }

  async write(owner: CopyOwner, epoch: string, batch: StoreWrite): Promise<void> {
    this.check();
    this.writes += 1;
    const entry = this.entry(owner, epoch);
    if (batch.copy !== null) entry.known = [batch.copy];
    entry.known.push(...batch.known);
    for (const edit of batch.waits) entry.waiting.set(edit.id, edit);
    for (const { id, update } of batch.durable) {
      entry.waiting.delete(id);
      if (batch.copy === null) entry.known.push(update);
    }
    for (const choice of batch.choices?.put ?? []) entry.choices.set(choice.id, choice);
    for (const id of batch.choices?.gone ?? []) entry.choices.delete(id);
    if (batch.client !== undefined) entry.clients.push(batch.client);
    entry.seq = batch.seq;
  }

  async forget(owner: CopyOwner, epoch: string, edits: readonly string[]): Promise<void> {
    this.check();
    const { graph, person } = owner;
    const isMeant = (e: StoredGraph) =>
      e.graph === graph && e.person.id === person.id && e.epoch === epoch;
    for (const { waiting } of this.entries.filter(isMeant))
      for (const id of edits) waiting.delete(id);
    const keep = this.entries.filter((e) => !isMeant(e) || e.waiting.size > 0);
    this.entries.splice(0, this.entries.length, ...keep);
  }

  async others({ graph, person }: CopyOwner) {
    this.check();
    return this.entries
      .filter((e) => e.graph === graph && e.person.id !== person.id && e.waiting.size > 0)
      .map((e) => ({ ...e.person, waiting: e.waiting.size }));
  }

  async graphs(person: string) {
    this.check();
    const own = this.entries.filter((e) => e.person.id === person);
    return own.map((e) => ({ graph: e.graph, usedAt: 0, waiting: e.waiting.size })).reverse();
  }

  async leave(person: string): Promise<void> {
    this.check();
    const stay = this.entries.filter(
      (e) => e.person.id !== person || e.waiting.size + e.choices.size > 0,
    );
    this.entries.splice(0, this.entries.length, ...stay);
  }

  /** The number of edits that wait on the device. */
  get waiting(): number {
    return this.entries.reduce((sum, entry) => sum + entry.waiting.size, 0);
  }

  private entry({ graph, person }: CopyOwner, epoch: string): StoredGraph {
    const old = this.entries.find(
      (e) => e.graph === graph && e.person.id === person.id && e.epoch === epoch,
    );
    if (old !== undefined) {
      this.entries.splice(this.entries.indexOf(old), 1);
      this.entries.push(old);
      return old;
    }
    const empty = { known: [], waiting: new Map(), choices: new Map(), clients: [] };
    const fresh = { graph, person, epoch, seq: 0, ...empty };
    this.entries.push(fresh);
    return fresh;
  }

  private check(): void {
    if (this.refuses) throw new DOMException("no room", "QuotaExceededError");
  }
}
