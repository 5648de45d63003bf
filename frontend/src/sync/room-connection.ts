/**
 * The connection of one document to its room: Yjs sync, awareness and acknowledgements.
 *
 * Speaks y-protocols (sync 0, awareness 1, query awareness 3) and, as our server offers it, kinds of
 * its own: how many of this socket's messages are durable and up to which entry of the log this
 * client has been sent (so that the page can say "saved" and mean it), which history this is, and
 * whether both show the same.
 *
 * Works without React. Edits go into `doc` at any time, also before the first answer and while
 * offline; they are merged, and counted in `unsaved` until the server has stored them. With a
 * device (see `keep`) they also survive the closing of the page.
 */

import * as decoding from "lib0/decoding";
import * as awarenessProtocol from "y-protocols/awareness";
import { Awareness, removeAwarenessStates } from "y-protocols/awareness";
import * as sync from "y-protocols/sync";
import * as Y from "yjs";
import { ChangedTwiceStore } from "./changed-twice";
import { FingerprintCheck } from "./fingerprint";
import { browserStore, epochName, madeNow, type StoredCopy, type UnsavedEdit } from "./indexed-db";
import * as messages from "./messages";
import { Outbox } from "./outbox";
import { Persistence } from "./persistence";
import { ReconnectingSocket, type SocketHandler } from "./reconnecting-socket";
import {
  lacksKnownEdits,
  ReplacedValues,
  type StrandedEdits,
  strandedEditsIn,
} from "./replaced-history";
import type {
  PersistenceOptions,
  RefusalReason,
  Room,
  RoomLink,
  RoomOptions,
  Socket,
} from "./room";
import { piecesOf } from "./split-update";

export * from "./room";

/** Above this size, in bytes, waiting edits are sent one by one. */
const LARGE = 1 << 18;

type LinkChange = Partial<Omit<RoomLink, "why" | "said" | "readOnly">> & {
  why?: RefusalReason | undefined;
  said?: string | undefined;
  readOnly?: string | undefined;
};

function mergedEdits(edits: readonly UnsavedEdit[]): Uint8Array {
  return Y.mergeUpdates(edits.map(({ update }) => update));
}

export function connectRoom(options: RoomOptions): Room {
  return new Connection(options);
}

class Connection implements Room, SocketHandler {
  readonly doc: Y.Doc;
  readonly awareness: Awareness;
  private readonly address: string;
  private readonly outbox = new Outbox();
  private readonly listeners = new Set<() => void>();
  private readonly persistence: Persistence | null;
  readonly changedTwice: ChangedTwiceStore;
  private readonly replaced: ReplacedValues;
  private readonly fingerprintCheck: FingerprintCheck;
  private readonly socket: ReconnectingSocket;
  private current: RoomLink = { state: "connecting", unsaved: 0, seq: 0 };
  /** The name of the history that this document belongs to; empty while unknown. */
  private epoch = "";
  private told = "";
  private closed = false;
  /**
   * The server's state vector until its step 2 has come: the page takes the server's edits before it sends its
   * own.
   */
  private asked: Uint8Array | null = null;
  private learned = false;
  /**
   * True while the socket may be dead. An edit that is sent then could be stored when the network is back, before
   * this page has received what others did meanwhile; their value would be lost.
   */
  private isDoubted = false;
  /** True while the page shows more of the log than the entry that the server named last. */
  private isAhead = false;

  constructor(options: RoomOptions) {
    this.doc = options.doc ?? new Y.Doc();
    this.awareness = new Awareness(this.doc);
    this.address = options.url;
    this.replaced = new ReplacedValues(this.doc, this);
    this.changedTwice = new ChangedTwiceStore(this.doc);
    this.doc.on("afterTransaction", this.onTransaction);
    this.awareness.on("update", this.onAwareness);
    this.fingerprintCheck = new FingerprintCheck(this.doc, this.atRest);
    this.socket = new ReconnectingSocket(
      {
        url: () => this.url(),
        open: options.open ?? ((address) => new WebSocket(address) as unknown as Socket),
        random: options.random ?? Math.random,
        admit: options.admit ?? null,
      },
      this,
    );
    this.persistence = options.keep ? this.keepingOf(options.keep) : null;
    if (this.persistence !== null) void this.recall(this.persistence);
    else this.socket.dial();
  }

  // Bound, so that they can be handed to `useSyncExternalStore`.
  readonly link = (): RoomLink => this.current;

  readonly onLink = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  settled(signal?: AbortSignal): Promise<number> {
    return new Promise((resolve, reject) => {
      const look = () => {
        const reason = signal?.aborted
          ? signal.reason
          : this.closed && new Error("the room was left");
        const { state, unsaved } = this.current;
        const done = state === "live" && unsaved === 0 && !this.isAhead;
        if (!reason && !done) return;
        stop();
        signal?.removeEventListener("abort", look);
        if (reason) reject(reason);
        else resolve(this.current.seq);
      };
      const stop = this.onLink(look);
      signal?.addEventListener("abort", look);
      look();
    });
  }

  shows(seq: number): Promise<void> {
    return new Promise((resolve) => {
      const look = () => {
        if (this.current.state === "live" && this.current.seq < seq) return;
        stop();
        resolve();
      };
      const stop = this.onLink(look);
      look();
    });
  }

  reconnect(): void {
    if (this.closed) return;
    this.say({ state: "connecting", why: undefined });
    this.socket.redial();
  }

  close(): void {
    if (this.closed) return;
    this.awareness.setLocalState(null);
    this.closed = true;
    this.doc.off("afterTransaction", this.onTransaction);
    this.doc.off("update", this.onUpdate);
    this.awareness.off("update", this.onAwareness);
    this.replaced.close();
    this.fingerprintCheck.close();
    this.socket.close();
    this.awareness.destroy();
    this.persistence?.close();
    this.say({ state: "offline" });
  }

  histories(): { readonly here: string; readonly theirs: string } {
    return { here: this.persistence?.epoch ?? this.epoch, theirs: this.told };
  }

  waiting(): readonly UnsavedEdit[] {
    return this.outbox.edits;
  }

  stranded(): StrandedEdits | null {
    const { edits } = this.outbox;
    return edits.length === 0 ? null : strandedEditsIn(this.doc, edits);
  }

  async forget(edits: readonly UnsavedEdit[] = this.outbox.edits): Promise<void> {
    const rest = this.outbox.edits.filter((edit) => !edits.includes(edit));
    if (rest.length === 0) await this.persistence?.forget(this.outbox.edits);
    else await this.persistence?.drop(edits);
    this.outbox.drop(edits);
    this.say({ unsaved: this.outbox.unsaved });
  }

  private say(change: LinkChange): void {
    const { why, said, readOnly, ...rest } = { ...this.current, ...change };
    const kept = this.persistence && { kept: this.persistence.kept };
    const next: RoomLink = {
      ...rest,
      ...kept,
      ...(why && { why }),
      ...(said && { said }),
      ...(readOnly && { readOnly }),
    };
    const old = this.current;
    if (
      old.state === next.state &&
      old.why === next.why &&
      old.said === next.said &&
      old.unsaved === next.unsaved &&
      old.kept === next.kept &&
      old.readOnly === next.readOnly &&
      old.seq === next.seq &&
      !this.closed
    )
      return;
    this.current = next;
    for (const listener of [...this.listeners]) listener();
  }

  // -- the device -----------------------------------------------------------------------------

  private keepingOf({
    device = browserStore(),
    graph,
    person,
    epoch,
  }: PersistenceOptions): Persistence {
    const kept = new Persistence(device, { graph, person }, this.doc.clientID, epoch ?? null, () =>
      this.say({}),
    );
    this.changedTwice.onChange(() => kept.undecided(this.changedTwice.undecided()));
    return kept;
  }

  private async recall(persistence: Persistence): Promise<void> {
    const kept = await persistence.load((late) => {
      if (this.closed || late === null) return;
      this.adopt(late);
      if (late.waiting.length > 0) this.socket.redial(); // so that they go the usual way
    });
    if (this.closed) return;
    this.epoch = epochName(persistence.epoch);
    if (kept !== null) this.adopt(kept);
    this.socket.dial();
  }

  private adopt({ known, waiting, seq, choices = [], clients = [] }: StoredCopy): void {
    this.doc.transact(() => {
      for (const update of known) Y.applyUpdate(this.doc, update, this);
      this.changedTwice.restore({ choices, clients });
      for (const { update } of waiting) Y.applyUpdate(this.doc, update, this);
    }, this);
    const recent = this.outbox.edits;
    this.outbox.clear();
    for (const edit of [...waiting, ...recent]) this.outbox.edited(edit);
    this.say({ unsaved: this.outbox.unsaved, seq: Math.max(seq, this.current.seq) });
  }

  /** Returns the whole document if everything in it is durable; else null. */
  private readonly copy = (): Uint8Array | null =>
    this.current.state === "live" && this.outbox.unsaved === 0
      ? Y.encodeStateAsUpdate(this.doc)
      : null;

  // -- socket ---------------------------------------------------------------------------------

  private url(): string {
    const url = new URL(this.address);
    url.searchParams.set("acks", "1");
    if (this.epoch !== "") {
      url.searchParams.set("epoch", this.epoch);
      if (this.current.seq > 0) url.searchParams.set("seq", String(this.current.seq));
    }
    return url.href;
  }

  hasWork(): boolean {
    return this.outbox.unsaved > 0;
  }

  probe(): Uint8Array<ArrayBuffer> {
    this.isDoubted = true;
    return messages.syncStep1(this.doc);
  }

  onOpen(): void {
    this.outbox.fresh();
    this.asked = null;
    this.learned = false;
    this.isDoubted = false;
    this.say({ readOnly: undefined });
    this.socket.send(messages.syncStep1(this.doc));
    // The others saw us go: only a newer clock brings us back.
    const state = this.awareness.getLocalState();
    if (state !== null) this.awareness.setLocalState(state);
  }

  onAway(why: RefusalReason | undefined, said?: string): void {
    this.say({ state: "offline", why, said });
  }

  onRefused(why: RefusalReason): void {
    this.say({ state: "refused", why, said: undefined });
  }

  /** Removes the others from the awareness until the socket is back. */
  onDrop(): void {
    const others = [...this.awareness.meta.keys()].filter((id) => id !== this.doc.clientID);
    removeAwarenessStates(this.awareness, others, this);
    // People who are still there come back with the clock that is known; an awareness takes that from unknown clients only.
    for (const id of others) this.awareness.meta.delete(id);
  }

  // -- what comes in --------------------------------------------------------------------------

  onMessage(data: Uint8Array): void {
    this.take(decoding.createDecoder(data));
  }

  private take(decoder: decoding.Decoder): void {
    switch (decoding.readVarUint(decoder)) {
      case messages.SYNC:
        this.takeSync(decoder);
        break;
      case messages.AWARENESS: {
        const update = decoding.readVarUint8Array(decoder);
        awarenessProtocol.applyAwarenessUpdate(this.awareness, update, this);
        break;
      }
      case messages.QUERY_AWARENESS:
        this.sendAwareness();
        break;
      case messages.ACK: {
        const stored = this.outbox.durable(decoding.readVarUint(decoder));
        const seq = decoding.readVarUint(decoder);
        this.changedTwice.durable(stored);
        if (stored.length > 0) this.persistence?.stored(stored);
        this.persistence?.shows(seq, this.copy);
        this.isAhead = false;
        this.say({ unsaved: this.outbox.unsaved, seq });
        this.fingerprintCheck.stir();
        break;
      }
      case messages.COMPARE:
        if (this.fingerprintCheck.differs(decoder)) this.socket.refuse("differs");
        break;
      case messages.READ_ONLY:
        this.say({ readOnly: decoding.readVarString(decoder) });
        break;
      case messages.EPOCH:
        this.named(decoding.readVarString(decoder));
        break;
    }
  }

  private takeSync(decoder: decoding.Decoder): void {
    const step = decoding.readVarUint(decoder);
    const content = decoding.readVarUint8Array(decoder);
    switch (step) {
      case sync.messageYjsSyncStep1:
        if (lacksKnownEdits(this.doc, this.outbox.edits, content))
          this.socket.refuse("other-epoch");
        else if (this.learned) this.give(content);
        else this.asked = content;
        break;
      case sync.messageYjsSyncStep2:
        if (!this.learned) this.changedTwice.back(this.outbox.edits);
        this.learn(content);
        this.learned = true;
        this.socket.arrived();
        this.isAhead = false;
        this.say({ state: "live", why: undefined, said: undefined });
        this.isDoubted = false;
        if (this.asked !== null) this.give(this.asked);
        else if (this.outbox.answered) this.giveUnsent();
        this.asked = null;
        break;
      case sync.messageYjsUpdate:
        this.isAhead = true;
        this.learn(content);
        break;
    }
  }

  /** Takes the name of the server's history. */
  private named(epoch: string): void {
    this.told = epoch;
    if (this.epoch !== "") return;
    this.epoch = epoch;
    this.persistence?.name(epoch, () => this.outbox.edits);
  }

  /** Returns the entry of the log that the document is exactly at; null while edits wait or the page is offline. */
  private readonly atRest = (): {
    readonly seq: number;
    send(frame: Uint8Array<ArrayBuffer>): void;
  } | null => {
    const { state, unsaved, seq } = this.current;
    if (state !== "live" || unsaved > 0 || seq === 0) return null;
    return { seq, send: (frame) => this.socket.send(frame) };
  };

  private learn(update: Uint8Array): void {
    const { seq } = this.current; // the one that counts in what comes now is told after it
    this.changedTwice.take(this.outbox.edits, seq, () => Y.applyUpdate(this.doc, update, this));
    this.persistence?.learned(update);
  }

  // -- what goes out --------------------------------------------------------------------------

  /** Returns a step 1 with what the server lacks, in pieces when that is too much for one message. */
  private give(state: Uint8Array): void {
    const whole = Y.encodeStateAsUpdate(this.doc, state);
    const edits = this.outbox.edits;
    if (whole.length <= LARGE) {
      // The edits as they were made: a value that has just lost here is collected, and no longer in the document.
      for (const piece of edits.length === 0 ? [] : piecesOf(mergedEdits(edits))) {
        this.outbox.sentPart();
        this.socket.send(messages.updateMessage(piece));
      }
      this.outbox.sentAll();
      this.socket.send(messages.syncStep2(whole));
      return;
    }
    // Without waiting edits only the list of all deletions is large, and the server has it.
    this.outbox.sentSome(0);
    this.socket.send(messages.syncStep2(messages.EMPTY_UPDATE));
    edits.forEach(({ update }, n) => {
      this.sendUpdate(update, () => this.outbox.sentSome(n + 1));
    });
  }

  /** Sends the edits that were held back while the socket was in doubt. */
  private giveUnsent(): void {
    const { unsent } = this.outbox;
    if (unsent.length === 0) return;
    this.sendUpdate(mergedEdits(unsent), () => this.outbox.sentAll());
  }

  /** Sends an update, in pieces where one message could not hold it; `sent` counts the last of them. */
  private sendUpdate(update: Uint8Array, sent: () => void): void {
    const pieces = piecesOf(update);
    pieces.forEach((piece, n) => {
      if (n === pieces.length - 1) sent();
      else this.outbox.sentPart();
      this.socket.send(messages.updateMessage(piece));
    });
  }

  /** Listens to updates of all transactions but those from the room: Yjs would encode these for nobody. */
  private readonly onTransaction = ({ origin }: Y.Transaction): void => {
    if (origin === this) this.doc.off("update", this.onUpdate);
    else this.doc.on("update", this.onUpdate);
  };

  private readonly onUpdate = (
    update: Uint8Array,
    _origin: unknown,
    _doc: Y.Doc,
    transaction: Y.Transaction,
  ): void => {
    if (transaction.local) {
      const edit = madeNow(update, this.replaced.take());
      this.persistence?.edited(edit);
      this.outbox.edited(edit);
    }
    // Until the room asked for what it lacks, everything travels with that answer, in order.
    if (this.outbox.answered && this.socket.isOpen && !this.isDoubted) {
      this.sendUpdate(update, () => this.outbox.sentAll());
    }
    this.say({ unsaved: this.outbox.unsaved });
  };

  private readonly onAwareness = (
    { added, updated, removed }: { added: number[]; updated: number[]; removed: number[] },
    origin: unknown,
  ): void => {
    if (origin === this) return;
    if ([...added, ...updated, ...removed].includes(this.doc.clientID)) this.sendAwareness();
  };

  private sendAwareness(): void {
    this.socket.send(messages.awarenessMessage(this.awareness));
  }
}
