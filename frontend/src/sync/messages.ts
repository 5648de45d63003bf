/** The messages and close codes of a room's socket: y-protocols, and ours. */

import * as encoding from "lib0/encoding";
import { type Awareness, encodeAwarenessUpdate } from "y-protocols/awareness";
import * as sync from "y-protocols/sync";
import type * as Y from "yjs";
import type { RefusalReason } from "./room";

export const SYNC = 0;
export const AWARENESS = 1;
export const QUERY_AWARENESS = 3;
/**
 * Acknowledgement: how many document messages of this socket are durable, and the entry of the log up to which it
 * was sent.
 */
export const ACK = 100;
/** Comparison: a fingerprint of the document, first the page's, then the server's. */
export const COMPARE = 101;
/** The kind of a message: read only, with a sentence that says why nobody may change this document. */
export const READ_ONLY = 102;
/** Epoch: the name of the history of the graph. */
export const EPOCH = 103;

/** Close codes after which coming again by itself is of no use. */
const REFUSED: ReadonlyMap<number, RefusalReason> = new Map([
  [1003, "not-accepted"],
  [1007, "not-accepted"],
  [1008, "forbidden"],
  [1009, "not-accepted"],
  [4401, "session-ended"],
  [4403, "forbidden"],
  [4404, "no-such-graph"],
  [4409, "other-epoch"],
  [4413, "full"],
]);
const FORBIDDEN = 4403;
/** Two documents with one client id: this one has to take another. */
const OTHER_CLIENT = "client id of another person";

/** Returns why the server refuses this page, if the close code says so. */
export function refusalOf(code: number, reason: string): RefusalReason | undefined {
  return code === FORBIDDEN && reason === OTHER_CLIENT ? "other-client" : REFUSED.get(code);
}

/** Close codes of what passes. */
export const RETRIED_CLOSES: ReadonlyMap<number, RefusalReason> = new Map([
  [1012, "restarting"],
  [1013, "too-slow"],
  [4503, "not-stored"],
]);

/** An update that brings nothing. */
export const EMPTY_UPDATE = new Uint8Array([0, 0]);

/** The content of a document as two numbers, see `fingerprint`. */
export interface Fingerprint {
  readonly entries: number;
  /** The sum of the CRCs: exact for any graph of ours. */
  readonly total: number;
}

type Bytes = Uint8Array<ArrayBuffer>;

/** Encodes sync step 1: the state vector of the document. */
export function syncStep1(doc: Y.Doc): Bytes {
  return message(SYNC, (encoder) => sync.writeSyncStep1(encoder, doc));
}

/** Encodes sync step 2: an update with everything that the server lacks. */
export function syncStep2(update: Uint8Array): Bytes {
  return edit(sync.messageYjsSyncStep2, update);
}

/** Encodes one update of Yjs. */
export function updateMessage(update: Uint8Array): Bytes {
  return edit(sync.messageYjsUpdate, update);
}

/** Encodes the fingerprint of the document as it is after entry `seq` of the log. */
export function compareMessage(seq: number, { entries, total }: Fingerprint): Bytes {
  return message(COMPARE, (encoder) => {
    for (const number of [seq, entries, total]) encoding.writeVarUint(encoder, number);
  });
}

/** Encodes the awareness state of this page. */
export function awarenessMessage(awareness: Awareness): Bytes {
  return message(AWARENESS, (encoder) =>
    encoding.writeVarUint8Array(encoder, encodeAwarenessUpdate(awareness, [awareness.clientID])),
  );
}

function edit(step: number, update: Uint8Array): Bytes {
  return message(SYNC, (encoder) => {
    encoding.writeVarUint(encoder, step);
    encoding.writeVarUint8Array(encoder, update);
  });
}

function message(kind: number, write: (encoder: encoding.Encoder) => void): Bytes {
  const encoder = encoding.createEncoder();
  encoding.writeVarUint(encoder, kind);
  write(encoder);
  return encoding.toUint8Array(encoder) as Bytes;
}
