/**
 * Compares the page's document with the server's by a fingerprint when nothing has happened for a while.
 *
 * Equal state vectors do not prove equal documents. So of all entries of the shared maps the CRC-32
 * of root, key and value is summed up, which needs no order and no secure context. The server's
 * twin is `editor/documents/fingerprint.py`; a shared vector in the tests of both holds them together.
 */

import * as decoding from "lib0/decoding";
import type * as Y from "yjs";
import { type Maps, mapsOf, ROOTS } from "../graph/document-keys";
import type { Fingerprint } from "./messages";
import * as messages from "./messages";

/** The comparison waits until nothing has happened for this time. */
const IDLE_MS = 5_000;

/** The state to compare: the document is exactly the log up to `seq`. */
export interface RestingState {
  readonly seq: number;
  send(frame: Uint8Array<ArrayBuffer>): void;
}

/** Asks the server once after each change, as soon as the document has been quiet for `IDLE_MS`. */
export class FingerprintCheck {
  private readonly doc: Y.Doc;
  private readonly atRest: () => RestingState | null;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private said: (Fingerprint & { readonly seq: number }) | null = null;

  constructor(doc: Y.Doc, atRest: () => RestingState | null) {
    this.doc = doc;
    this.atRest = atRest;
  }

  /** Restarts the wait for a quiet moment; called after each change. */
  stir(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.ask(), IDLE_MS);
  }

  /** Reads the server's answer and returns true if its fingerprint differs from the one that was asked about. */
  differs(decoder: decoding.Decoder): boolean {
    const [seq, entries, total] = [0, 0, 0].map(() => decoding.readVarUint(decoder));
    const said = this.said;
    if (said === null || said.seq !== seq || this.atRest()?.seq !== seq) return false;
    if (said.entries === entries && said.total === total) return false;
    console.error(
      `After change ${seq} this page shows`,
      said,
      "and the server has",
      entries,
      total,
    );
    return true;
  }

  close(): void {
    clearTimeout(this.timer);
  }

  private ask(): void {
    const rest = this.atRest();
    if (rest === null || rest.seq === this.said?.seq) return;
    this.said = { seq: rest.seq, ...fingerprint(mapsOf(this.doc)) };
    rest.send(messages.compareMessage(rest.seq, this.said));
  }
}

export function fingerprint(maps: Maps): Fingerprint {
  let [entries, total] = [0, 0];
  for (const root of ROOTS) {
    const head = crcOf(`${root}\0`);
    for (const [key, value] of maps[root]) {
      entries += 1;
      total += (crcOfValue(crcOf(`${key}\0`, head), value) ^ -1) >>> 0;
    }
  }
  return { entries, total };
}

const TABLE = Int32Array.from({ length: 256 }, (_, n) => {
  let crc = n;
  for (let bit = 0; bit < 8; bit += 1) crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  return crc;
});
const utf8 = new TextEncoder();
const double = new DataView(new ArrayBuffer(8));

/** Continues a CRC-32 from `begun`; the result is not inverted yet. */
function crcOfBytes(bytes: Uint8Array, begun = -1): number {
  let crc = begun;
  for (const byte of bytes) crc = (TABLE[(crc ^ byte) & 0xff] ?? 0) ^ (crc >>> 8);
  return crc;
}

const crcOf = (text: string, begun?: number) => crcOfBytes(utf8.encode(text), begun);

function crcOfNumber(value: number, begun: number): number {
  double.setFloat64(0, value + 0, true);
  return crcOfBytes(new Uint8Array(double.buffer), begun);
}

function crcOfValue(begun: number, value: unknown): number {
  if (typeof value === "boolean") return crcOf(value ? "t" : "f", begun);
  if (typeof value === "string") return crcOf(`s${value}`, begun);
  if (typeof value === "number") return crcOfNumber(value, crcOf("n", begun));
  if (Array.isArray(value) && value.every((item) => typeof item === "number")) {
    return value.reduce((crc, item) => crcOfNumber(item, crc), crcOf("a", begun));
  }
  return crcOf("?", begun);
}
