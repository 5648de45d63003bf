/**
 * Persistence of a room's edits on this device: they are stored as they are made and let go once durable.
 *
 * Writes are grouped: while one is under way, what comes next waits for the one after it. What
 * others change is written with the next edit that may build on it, or a little later.
 */

import {
  type ChangedTwice,
  type CopyOwner,
  type EditStore,
  idOf,
  type StoredCopy,
  type StoreWrite,
  UNNAMED_EPOCH,
  type UnsavedEdit,
} from "./indexed-db";

/** The page does not wait longer than this for the device. */
const PATIENCE_MS = 3_000;
const KNOWN_LATER_MS = 2_000;
const AGAIN_MS = 10_000;
/** After so many updates the copy is written anew as a whole. */
const TAIL = 200;

export class Persistence {
  /** Under which history all this is kept. */
  epoch = UNNAMED_EPOCH;
  private readonly only: string | null;
  private readonly device: EditStore;
  private readonly owner: CopyOwner;
  private readonly onChange: () => void;
  private waits: UnsavedEdit[] = [];
  private known: Uint8Array[] = [];
  private durable: UnsavedEdit[] = [];
  /** Values that the person has not chosen between yet, by id, and the ids to write or to remove. */
  private choices: ReadonlyMap<string, ChangedTwice> = new Map();
  private unwritten = new Set<string>();
  private readonly client: number;
  private seq = 0;
  private tail = 0;
  private copy: (() => Uint8Array | null) | null = null;
  private writing: Promise<void> | null = null;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private opened = false;
  private failed = false;
  private closed = false;

  /** `only` this history, if it is given; else the one that was used last. `client` is the id of the edits. */
  constructor(
    device: EditStore,
    owner: CopyOwner,
    client: number,
    only: string | null,
    onChange: () => void,
  ) {
    this.device = device;
    this.owner = owner;
    this.client = client;
    this.only = only;
    this.epoch = only ?? UNNAMED_EPOCH;
    this.onChange = onChange;
  }

  /** True if all edits that wait are stored on this device. */
  get kept(): boolean {
    return this.opened && !this.failed && this.waits.length === 0;
  }

  /** Takes the name that the server gave the history: a copy without a name moves there. */
  name(epoch: string, waiting: () => readonly UnsavedEdit[]): void {
    if (this.epoch === UNNAMED_EPOCH) void this.move(epoch, waiting);
  }

  private async move(epoch: string, waiting: () => readonly UnsavedEdit[]): Promise<void> {
    while (this.writing !== null) await this.writing;
    this.epoch = epoch;
    this.waits = [...waiting()];
    const moved = this.waits.map(idOf);
    this.unwritten = new Set(this.choices.keys());
    this.tail = TAIL + 1; // the copy is written whole
    this.flush();
    while (this.writing !== null) await this.writing;
    try {
      if (this.opened && !this.failed) await this.device.forget(this.owner, UNNAMED_EPOCH, moved);
    } catch (error) {
      this.fail(error);
    }
  }

  /**
   * Reads the copy of this device. `late` is called with it when the device answers only after the page went on
   * without.
   */
  async load(late: (kept: StoredCopy | null) => void): Promise<StoredCopy | null> {
    let given = false;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const reading = this.read();
    const patience = new Promise<null>((resolve) => {
      timer = setTimeout(() => {
        given = true;
        resolve(null);
      }, PATIENCE_MS);
    });
    const kept = await Promise.race([reading, patience]);
    clearTimeout(timer);
    if (given) void reading.then(late);
    return kept;
  }

  private async read(): Promise<StoredCopy | null> {
    try {
      const all = await this.device.read(this.owner);
      // The server may have named the history meanwhile.
      const only = this.epoch === UNNAMED_EPOCH ? this.only : this.epoch;
      const kept = (only === null ? all.at(-1) : all.find((each) => each.epoch === only)) ?? null;
      this.opened = true;
      this.epoch = kept?.epoch ?? this.epoch;
      this.seq = Math.max(this.seq, kept?.seq ?? 0);
      this.tail += kept?.known.length ?? 0;
      if (this.waits.length > 0 || this.unwritten.size > 0) this.flush();
      return kept;
    } catch (error) {
      this.fail(error);
      return null;
    }
  }

  /** Stores an edit that the person made. */
  edited(edit: UnsavedEdit): void {
    this.waits.push(edit);
    this.flush();
  }

  /** Stores an update of the server with the next write. */
  learned(update: Uint8Array): void {
    this.known.push(update);
    this.soon();
  }

  /** Keeps the choices that the person still has to make; those of before that are missing were made. */
  undecided(choices: readonly ChangedTwice[]): void {
    const now = new Map(choices.map((choice) => [choice.id, choice]));
    for (const id of new Set([...this.choices.keys(), ...now.keys()])) {
      if (this.choices.get(id) !== now.get(id)) this.unwritten.add(id);
    }
    this.choices = now;
    if (this.unwritten.size > 0) this.flush();
  }

  /** Marks edits as stored by the server: they wait no more. */
  stored(edits: readonly UnsavedEdit[]): void {
    this.durable.push(...edits);
    this.flush();
  }

  /** Notes that the page shows the log up to `seq`. `copy` returns the whole document while no edit waits. */
  shows(seq: number, copy: () => Uint8Array | null): void {
    if (seq === this.seq && this.copy !== null) return;
    this.seq = seq;
    this.copy = copy;
    this.soon();
  }

  /** Deletes these edits, the durable ones, and the copy unless edits of another page wait on it. */
  async forget(edits: readonly UnsavedEdit[]): Promise<void> {
    clearTimeout(this.timer);
    this.waits = [];
    while (this.writing !== null) await this.writing;
    const gone = [...edits, ...this.durable].map(idOf);
    this.waits = [];
    this.known = [];
    this.durable = [];
    this.unwritten.clear();
    if (this.opened) await this.device.forget(this.owner, this.epoch, gone);
    this.opened = false;
  }

  /** Deletes these of the waiting edits. */
  async drop(edits: readonly UnsavedEdit[]): Promise<void> {
    const isGone = (edit: UnsavedEdit) => edits.includes(edit);
    this.waits = this.waits.filter((edit) => !isGone(edit));
    while (this.writing !== null) await this.writing;
    this.waits = this.waits.filter((edit) => !isGone(edit)); // also after a write that failed
    if (this.opened) await this.device.forget(this.owner, this.epoch, edits.map(idOf));
  }

  /** Writes the rest and stops. */
  close(): void {
    this.closed = true;
    clearTimeout(this.timer);
    const { waits, known, durable, unwritten } = this;
    if (waits.length + known.length + durable.length + unwritten.size > 0) this.flush();
  }

  private soon(wait = KNOWN_LATER_MS): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.flush(), wait);
  }

  private flush(): void {
    if (!this.opened || this.writing !== null) return;
    const batch = this.batch();
    this.writing = this.device.write(this.owner, this.epoch, batch).then(
      () => this.wrote(batch),
      (error: unknown) => this.lost(batch, error),
    );
  }

  private batch(): StoreWrite {
    const { waits, known, durable, seq, choices, client } = this;
    this.tail += known.length + durable.length;
    const copy = this.tail > TAIL ? (this.copy?.() ?? null) : null;
    if (copy !== null) this.tail = 1;
    this.known = [];
    this.durable = [];
    const ids = [...this.unwritten];
    this.unwritten.clear();
    return {
      waits: [...waits],
      known: copy === null ? known : [],
      ...{ durable, copy, seq },
      choices: {
        put: ids.flatMap((id) => choices.get(id) ?? []),
        gone: ids.filter((id) => !choices.has(id)),
      },
      ...(durable.length > 0 && { client }),
    };
  }

  private wrote(batch: StoreWrite): void {
    const written = new Set(batch.waits);
    this.writing = null;
    this.failed = false;
    this.waits = this.waits.filter((edit) => !written.has(edit));
    if (this.waits.length + this.durable.length + this.unwritten.size > 0) this.flush();
    this.onChange();
  }

  private lost(batch: StoreWrite, error: unknown): void {
    this.writing = null;
    this.known.unshift(...batch.known);
    this.durable.unshift(...batch.durable);
    for (const id of [...(batch.choices?.put ?? []).map(idOf), ...(batch.choices?.gone ?? [])]) {
      this.unwritten.add(id);
    }
    if (!this.closed) this.soon(AGAIN_MS);
    this.fail(error);
  }

  private fail(error: unknown): void {
    if (!this.failed) console.warn("This device does not keep edits:", error);
    this.failed = true;
    this.onChange();
  }
}
