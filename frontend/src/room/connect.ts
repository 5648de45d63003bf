/**
 * The connection of one document to its room: Yjs sync, awareness and acknowledgements.
 *
 * Speaks y-protocols (sync 0, awareness 1, query awareness 3) and, as our server offers it, type
 * 100: how many of this socket's messages are durable, and up to which entry of the log this client
 * has been sent. So the page can say "saved" and mean it, and can name the moment it shows.
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
import { browser, freshId, type Kept, type Waiting } from "./device";
import * as frames from "./frames";
import { type Stranded, strandedIn, wentBack } from "./history";
import { Keeping } from "./keeping";
import { Outbox } from "./outbox";
import type { Admit, ConnectOptions, Keep, Link, Room, Socket, Why } from "./room";

export * from "./room";

/** The server says something at least every 15 s; a socket this silent is dead. */
const SILENCE_MS = 30_000;
const OPENING_MS = 10_000;
const FIRST_RETRY_MS = 300;
const LAST_RETRY_MS = 10_000;
/** Nobody looks at a hidden page; with nothing to save it may take its time. */
const HIDDEN_RETRY_MS = 60_000;
/** An answer to a question that any living server answers at once. */
const PROBE_MS = 5_000;
/** Above this, edits that wait travel one by one; a message may have 1 MiB. */
const LARGE = 1 << 19;
const OPEN = 1;

type Change = Partial<Omit<Link, "why" | "readOnly">> & {
  why?: Why | undefined;
  readOnly?: string | undefined;
};

const madeNow = (update: Uint8Array): Waiting => ({ id: freshId(), update, at: Date.now() });

export function connect(options: ConnectOptions): Room {
  return new Connection(options);
}

class Connection implements Room {
  readonly doc: Y.Doc;
  readonly awareness: Awareness;
  private readonly url: string;
  private readonly openSocket: (url: string) => Socket;
  private readonly random: () => number;
  private readonly outbox = new Outbox();
  private readonly listeners = new Set<() => void>();
  private readonly keeping: Keeping | null;
  private readonly admit: Admit | null;
  private current: Link = { state: "connecting", unsaved: 0, seq: 0 };
  private socket: Socket | null = null;
  private heardAt = 0;
  private probedAt: number | null = null;
  private turn = 0;
  private attempts = 0;
  private retry: ReturnType<typeof setTimeout> | undefined;
  private readonly watch: ReturnType<typeof setInterval>;
  private closed = false;

  constructor(options: ConnectOptions) {
    this.doc = options.doc ?? new Y.Doc();
    this.awareness = new Awareness(this.doc);
    const url = new URL(options.url);
    url.searchParams.set("acks", "1");
    this.url = url.href;
    this.openSocket = options.open ?? ((address) => new WebSocket(address) as unknown as Socket);
    this.random = options.random ?? Math.random;
    this.doc.on("update", this.onUpdate);
    this.awareness.on("update", this.onAwareness);
    globalThis.addEventListener?.("online", this.onWake);
    globalThis.addEventListener?.("offline", this.onWake);
    globalThis.document?.addEventListener("visibilitychange", this.onVisibility);
    this.watch = setInterval(this.onWatch, 1_000);
    this.admit = options.admit ?? null;
    this.keeping = options.keep ? this.keepingOf(options.keep) : null;
    if (this.keeping !== null && !options.keep?.anew) void this.recall(this.keeping);
    else this.dial();
  }

  // Bound, so that they can be handed to `useSyncExternalStore`.
  readonly link = (): Link => this.current;

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
        const done = this.current.state === "live" && this.current.unsaved === 0;
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

  reconnect(): void {
    if (this.closed) return;
    this.attempts = 0;
    this.drop();
    this.say({ state: "connecting", why: undefined });
    this.dial();
  }

  close(): void {
    if (this.closed) return;
    this.awareness.setLocalState(null);
    this.closed = true;
    clearInterval(this.watch);
    clearTimeout(this.retry);
    globalThis.removeEventListener?.("online", this.onWake);
    globalThis.removeEventListener?.("offline", this.onWake);
    globalThis.document?.removeEventListener("visibilitychange", this.onVisibility);
    this.doc.off("update", this.onUpdate);
    this.awareness.off("update", this.onAwareness);
    this.drop();
    this.awareness.destroy();
    this.keeping?.close();
    this.say({ state: "offline" });
  }

  stranded(): Stranded | null {
    if (this.current.why !== "other-epoch") return null;
    return strandedIn(this.doc, this.outbox.edits);
  }

  async forget(): Promise<void> {
    await this.keeping?.forget();
    this.outbox.clear();
    this.say({ unsaved: 0 });
  }

  private say(change: Change): void {
    const { why, readOnly, ...rest } = { ...this.current, ...change };
    const kept = this.keeping && { kept: this.keeping.kept };
    const next: Link = { ...rest, ...kept, ...(why && { why }), ...(readOnly && { readOnly }) };
    const old = this.current;
    if (
      old.state === next.state &&
      old.why === next.why &&
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

  private keepingOf({ device = browser(), graph, person, anew }: Keep): Keeping {
    const keeping = new Keeping(device, { graph, person }, () => this.say({}));
    if (anew) keeping.begin();
    return keeping;
  }

  private async recall(keeping: Keeping): Promise<void> {
    const kept = await keeping.load((late) => {
      if (this.closed || late === null) return;
      this.adopt(late);
      if (late.waiting.length > 0) this.reconnectNow(); // so that they go the usual way
    });
    if (this.closed) return;
    if (kept !== null) this.adopt(kept);
    this.dial();
  }

  private adopt({ known, waiting, seq }: Kept): void {
    this.doc.transact(() => {
      for (const update of known) Y.applyUpdate(this.doc, update, this);
      for (const { update } of waiting) Y.applyUpdate(this.doc, update, this);
    }, this);
    const recent = this.outbox.edits;
    this.outbox.clear();
    for (const edit of [...waiting, ...recent]) this.outbox.edited(edit);
    this.say({ unsaved: this.outbox.unsaved, seq: Math.max(seq, this.current.seq) });
  }

  /** The whole document, when it holds nothing but what is durable. */
  private readonly copy = (): Uint8Array | null =>
    this.current.state === "live" && this.outbox.unsaved === 0
      ? Y.encodeStateAsUpdate(this.doc)
      : null;

  // -- the socket -----------------------------------------------------------------------------

  private dial(): void {
    clearTimeout(this.retry);
    this.turn += 1;
    if (this.admit === null) this.enter();
    else void this.knock(this.admit, this.turn);
  }

  private async knock(admit: Admit, turn: number): Promise<void> {
    const why = await admit(this.attempts > 0).catch(() => "nobody" as const);
    if (turn !== this.turn || this.closed) return;
    if (why === null) this.enter();
    else if (why === "nobody") this.stayAway(undefined);
    else this.say({ state: "refused", why });
  }

  private enter(): void {
    const socket = this.openSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heardAt = Date.now();
    this.probedAt = null;
    socket.onopen = () => this.onOpen(socket);
    socket.onmessage = ({ data }) => this.onMessage(socket, data);
    socket.onclose = ({ code }) => this.onClose(socket, code);
    socket.onerror = () => undefined; // a close event follows
  }

  private onOpen(socket: Socket): void {
    if (socket !== this.socket) return;
    this.heardAt = Date.now();
    this.outbox.fresh();
    this.say({ readOnly: undefined });
    this.send(frames.question(this.doc));
    // The others saw us go: only a newer clock brings us back.
    const state = this.awareness.getLocalState();
    if (state !== null) this.awareness.setLocalState(state);
  }

  private onClose(socket: Socket, code: number): void {
    if (socket !== this.socket) return;
    this.drop();
    const refused = frames.REFUSED.get(code);
    if (refused !== undefined) {
      this.say({ state: "refused", why: refused });
      return;
    }
    this.stayAway(frames.PASSING.get(code));
  }

  private stayAway(why: Why | undefined): void {
    this.say({ state: "offline", why });
    this.dialLater();
  }

  private dialLater(): void {
    const idle = globalThis.document?.visibilityState === "hidden" && this.outbox.unsaved === 0;
    const soon = Math.min(LAST_RETRY_MS, FIRST_RETRY_MS * 2 ** this.attempts);
    const longest = idle ? HIDDEN_RETRY_MS : soon;
    this.attempts += 1;
    clearTimeout(this.retry);
    this.retry = setTimeout(() => this.dial(), longest * (0.5 + this.random() / 2));
  }

  /** Forgets the socket; the others are out of sight until it is back. */
  private drop(): void {
    clearTimeout(this.retry);
    this.turn += 1;
    const socket = this.socket;
    this.socket = null;
    if (socket !== null) {
      socket.onopen = socket.onmessage = socket.onclose = null;
      socket.close();
    }
    const others = [...this.awareness.meta.keys()].filter((id) => id !== this.doc.clientID);
    removeAwarenessStates(this.awareness, others, this);
    // Whoever is still there comes back with the clock that is known; only strangers may do that.
    for (const id of others) this.awareness.meta.delete(id);
  }

  /** The network or the page changed: try at once, or see whether the socket still lives. */
  private readonly onWake = (): void => {
    if (this.closed) return;
    if (this.current.state === "offline") this.reconnectNow();
    else if (this.current.state === "live") this.probe();
  };

  private readonly onVisibility = (): void => {
    if (globalThis.document.visibilityState === "visible") this.onWake();
  };

  private probe(): void {
    this.probedAt = Date.now();
    this.send(frames.question(this.doc));
  }

  private reconnectNow(): void {
    this.attempts = 0;
    this.drop();
    this.dial();
  }

  private readonly onWatch = (): void => {
    if (this.socket === null) return;
    const limit = this.socket.readyState === OPEN ? SILENCE_MS : OPENING_MS;
    const now = Date.now();
    const mute = this.probedAt !== null && now - this.probedAt > PROBE_MS;
    if (mute || now - this.heardAt > limit) this.onClose(this.socket, 1006);
  };

  private send(frame: Uint8Array<ArrayBuffer>): void {
    if (this.socket?.readyState === OPEN) this.socket.send(frame);
  }

  // -- what comes in --------------------------------------------------------------------------

  private onMessage(socket: Socket, data: unknown): void {
    if (socket !== this.socket) return;
    this.heardAt = Date.now();
    this.probedAt = null;
    if (!(data instanceof ArrayBuffer)) return;
    try {
      this.take(socket, decoding.createDecoder(new Uint8Array(data)));
    } catch (error) {
      console.error("The room sent something that cannot be read", error);
      this.onClose(socket, 1006);
    }
  }

  private take(socket: Socket, decoder: decoding.Decoder): void {
    switch (decoding.readVarUint(decoder)) {
      case frames.SYNC:
        this.takeSync(socket, decoder);
        break;
      case frames.AWARENESS: {
        const update = decoding.readVarUint8Array(decoder);
        awarenessProtocol.applyAwarenessUpdate(this.awareness, update, this);
        break;
      }
      case frames.QUERY_AWARENESS:
        this.sendAwareness();
        break;
      case frames.ACK: {
        const stored = this.outbox.durable(decoding.readVarUint(decoder));
        const seq = decoding.readVarUint(decoder);
        if (stored.length > 0) this.keeping?.stored(stored);
        this.keeping?.shows(seq, this.copy);
        this.say({ unsaved: this.outbox.unsaved, seq });
        break;
      }
      case frames.READ_ONLY:
        this.say({ readOnly: decoding.readVarString(decoder) });
        break;
    }
  }

  private takeSync(socket: Socket, decoder: decoding.Decoder): void {
    const step = decoding.readVarUint(decoder);
    const content = decoding.readVarUint8Array(decoder);
    switch (step) {
      case sync.messageYjsSyncStep1:
        if (wentBack(this.doc, this.outbox.edits, content))
          this.onClose(socket, frames.OTHER_EPOCH);
        else this.give(content);
        break;
      case sync.messageYjsSyncStep2:
        this.learn(content);
        this.attempts = 0;
        this.say({ state: "live", why: undefined });
        break;
      case sync.messageYjsUpdate:
        this.learn(content);
        break;
    }
  }

  private learn(update: Uint8Array): void {
    Y.applyUpdate(this.doc, update, this);
    this.keeping?.learned(update);
  }

  // -- what goes out --------------------------------------------------------------------------

  /** The answer to a step 1: what the server lacks, in pieces when that is too much for one. */
  private give(state: Uint8Array): void {
    const whole = Y.encodeStateAsUpdate(this.doc, state);
    const edits = this.outbox.edits;
    if (whole.length <= LARGE || edits.length === 0) {
      this.outbox.sentAll();
      this.send(frames.answer(whole));
      return;
    }
    this.outbox.sentSome(0);
    this.send(frames.answer(frames.NOTHING));
    edits.forEach(({ update }, n) => {
      this.outbox.sentSome(n + 1);
      this.send(frames.change(update));
    });
  }

  private readonly onUpdate = (
    update: Uint8Array,
    origin: unknown,
    _doc: Y.Doc,
    transaction: Y.Transaction,
  ): void => {
    if (origin === this) return;
    if (transaction.local) this.outbox.edited(this.keeping?.edited(update) ?? madeNow(update));
    // Until the room asked for what it lacks, everything travels with that answer, in order.
    if (this.outbox.answered && this.socket?.readyState === OPEN) {
      this.outbox.sentAll();
      this.send(frames.change(update));
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
    this.send(frames.presence(this.awareness));
  }
}
