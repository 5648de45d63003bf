/**
 * A room server in memory for tests, over sockets that are plain objects.
 *
 * See docs/room-protocol.md.
 */

import * as decoding from "lib0/decoding";
import * as encoding from "lib0/encoding";
import * as sync from "y-protocols/sync";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { fingerprint } from "../sync/fingerprint";
import type { Socket } from "../sync/room-connection";

export class FakeSocket implements Socket {
  binaryType: BinaryType = "blob";
  readyState = 0;
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: unknown }) => void) | null = null;
  onclose: ((event: { code: number; reason?: string }) => void) | null = null;
  onerror: (() => void) | null = null;
  /** Document messages that were committed. */
  durable = 0;
  readonly received: Uint8Array[] = [];
  readonly url: string;
  private readonly server: FakeServer;

  constructor(url: string, server: FakeServer) {
    this.url = url;
    this.server = server;
  }

  send(data: Uint8Array<ArrayBuffer>): void {
    if (this.readyState !== 1) throw new Error("not open");
    this.received.push(data);
    this.server.take(this, data);
  }

  close(): void {
    this.readyState = 3;
  }

  /** The server or the network ends it. */
  end(code: number, reason = ""): void {
    this.readyState = 3;
    this.onclose?.({ code, reason });
  }

  deliver(data: Uint8Array): void {
    if (this.readyState === 1) this.onmessage?.({ data: data.slice().buffer });
  }
}

/** The largest update that rule R4 allows, in bytes. */
const MESSAGE_LIMIT = 1 << 20;

export class FakeServer {
  readonly doc = new Y.Doc();
  seq = 0;
  /** While set, what comes in is taken but not committed: no broadcast, no ack. */
  stalled = false;
  /** The close code with which an update is refused; null for one that is taken. */
  refuses: (update: Uint8Array) => number | null = (update) =>
    update.length > MESSAGE_LIMIT ? 1009 : null;
  /** The name of the history; empty for a server that does not name it. */
  epoch: string;
  /** The number of comparisons that did not match. */
  divergences = 0;
  readonly sockets: FakeSocket[] = [];
  private readonly log: { socket: FakeSocket; update: Uint8Array }[] = [];

  constructor(epoch = "") {
    this.epoch = epoch;
  }

  readonly open = (url: string): FakeSocket => {
    const socket = new FakeSocket(url, this);
    this.sockets.push(socket);
    return socket;
  };

  get last(): FakeSocket {
    const socket = this.sockets.at(-1);
    if (socket === undefined) throw new Error("nobody has come");
    return socket;
  }

  /** Lets the newest socket in. */
  accept(): FakeSocket {
    const socket = this.last;
    socket.readyState = 1;
    socket.onopen?.();
    if (this.epoch !== "") {
      const named = encoding.createEncoder();
      encoding.writeVarUint(named, 103);
      encoding.writeVarString(named, this.epoch);
      socket.deliver(encoding.toUint8Array(named));
      const known = new URL(socket.url).searchParams;
      const other = (known.get("epoch") ?? this.epoch) !== this.epoch;
      if (other || Number(known.get("seq") ?? 0) > this.seq) {
        socket.end(4409);
        return socket;
      }
    }
    const encoder = encoding.createEncoder();
    encoding.writeVarUint(encoder, 0);
    sync.writeSyncStep1(encoder, this.doc);
    socket.deliver(encoding.toUint8Array(encoder));
    return socket;
  }

  take(socket: FakeSocket, data: Uint8Array): void {
    const decoder = decoding.createDecoder(data);
    const sort = decoding.readVarUint(decoder);
    if (sort === 101) this.compare(socket, decoder);
    if (sort !== 0) return;
    const kind = decoding.readVarUint(decoder);
    const content = decoding.readVarUint8Array(decoder);
    if (kind !== sync.messageYjsSyncStep1) {
      const code = this.refuses(content);
      if (code !== null) {
        socket.readyState = 3; // what it says later is not heard
        queueMicrotask(() => socket.end(code));
        return;
      }
      this.log.push({ socket, update: content });
      if (!this.stalled) this.commit();
      return;
    }
    const encoder = encoding.createEncoder();
    encoding.writeVarUint(encoder, 0);
    sync.writeSyncStep2(encoder, this.doc, content);
    socket.deliver(encoding.toUint8Array(encoder));
    this.ack(socket);
  }

  /** Commits and acknowledges everything that came. */
  commit(): void {
    for (const { socket, update } of this.log.splice(0)) {
      const before = Y.encodeStateVector(this.doc).toString() + this.doc.store.pendingStructs;
      Y.applyUpdate(this.doc, update);
      const after = Y.encodeStateVector(this.doc).toString() + this.doc.store.pendingStructs;
      if (before !== after) this.seq += 1;
      socket.durable += 1;
      this.ack(socket);
    }
  }

  /** Drops what came and was not committed. */
  lose(): void {
    this.log.length = 0;
  }

  /** Makes an edit as a colleague and sends it to the newest socket. */
  broadcast(work: (doc: Y.Doc) => void): void {
    const before = Y.encodeStateVector(this.doc);
    work(this.doc);
    this.seq += 1;
    const encoder = encoding.createEncoder();
    encoding.writeVarUint(encoder, 0);
    sync.writeUpdate(encoder, Y.encodeStateAsUpdate(this.doc, before));
    this.last.deliver(encoding.toUint8Array(encoder));
    this.ack(this.last);
  }

  /** Sends an awareness state of another client. */
  presence(client: number, clock: number, state: unknown): void {
    const inner = encoding.createEncoder();
    encoding.writeVarUint(inner, 1);
    encoding.writeVarUint(inner, client);
    encoding.writeVarUint(inner, clock);
    encoding.writeVarString(inner, JSON.stringify(state));
    const encoder = encoding.createEncoder();
    encoding.writeVarUint(encoder, 1);
    encoding.writeVarUint8Array(encoder, encoding.toUint8Array(inner));
    this.last.deliver(encoding.toUint8Array(encoder));
  }

  private compare(socket: FakeSocket, decoder: decoding.Decoder): void {
    const [seq, entries, total] = [0, 0, 0].map(() => decoding.readVarUint(decoder));
    if (seq !== this.seq) return;
    const mine = fingerprint(mapsOf(this.doc));
    if (mine.entries !== entries || mine.total !== total) this.divergences += 1;
    const encoder = encoding.createEncoder();
    for (const n of [101, seq, mine.entries, mine.total]) encoding.writeVarUint(encoder, n);
    socket.deliver(encoding.toUint8Array(encoder));
  }

  ack(socket: FakeSocket): void {
    const encoder = encoding.createEncoder();
    encoding.writeVarUint(encoder, 100);
    encoding.writeVarUint(encoder, socket.durable);
    encoding.writeVarUint(encoder, this.seq);
    socket.deliver(encoding.toUint8Array(encoder));
  }
}

/** The awareness states that a socket sent, the newest last. */
export function statesSent(socket: FakeSocket): { clock: number; state: unknown }[] {
  return socket.received.flatMap((data) => {
    const decoder = decoding.createDecoder(data);
    if (decoding.readVarUint(decoder) !== 1) return [];
    const inner = decoding.createDecoder(decoding.readVarUint8Array(decoder));
    decoding.readVarUint(inner);
    decoding.readVarUint(inner);
    const clock = decoding.readVarUint(inner);
    return [{ clock, state: JSON.parse(decoding.readVarString(inner)) as unknown }];
  });
}
