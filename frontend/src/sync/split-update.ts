/**
 * A large update of Yjs in pieces that a room takes one after the other.
 *
 * A message may have 1 MiB (rule R4 of docs/room-protocol.md), and a person can change more than that
 * at once. Items come first, in the order in which they were made, then what was deleted: whoever sees
 * the pieces one by one misses nothing for a moment.
 */

import * as encoding from "lib0/encoding";
import * as Y from "yjs";

/** Far below what a message may have, so that a room has time for others in between. */
const PIECE = 1 << 18;

type Struct = ReturnType<typeof Y.decodeUpdate>["structs"][number];
interface Range {
  readonly client: number;
  readonly clock: number;
  readonly len: number;
}

/** Pieces that together are the update; the update itself where it is small. */
export function piecesOf(update: Uint8Array, most = PIECE): readonly Uint8Array[] {
  if (update.length <= most) return [update];
  const { structs, ds } = Y.decodeUpdate(update);
  const ranges = [...ds.clients].flatMap(([client, deleted]) =>
    deleted.map(({ clock, len }): Range => ({ client, clock, len })),
  );
  return [
    ...grouped(structs, most, bytesOf, follows).map((some) => encoded(some, [])),
    ...grouped(
      ranges,
      most,
      () => RANGE,
      () => true,
    ).map((some) => encoded([], some)),
  ];
}

/** More than two numbers take. */
const RANGE = 16;

function bytesOf(struct: Struct): number {
  const encoder = new Y.UpdateEncoderV1();
  struct.write(encoder, 0);
  return encoder.toUint8Array().length;
}

/** A gap is not written: the piece ends before it. */
function follows(before: Struct, struct: Struct): boolean {
  return (
    before.id.client === struct.id.client && before.id.clock + before.length === struct.id.clock
  );
}

function grouped<T>(
  all: readonly T[],
  most: number,
  size: (each: T) => number,
  fits: (before: T, each: T) => boolean,
): T[][] {
  const groups: T[][] = [];
  let bytes = 0;
  for (const each of all) {
    if (each instanceof Y.Skip) continue;
    const own = size(each);
    const group = groups.at(-1);
    const last = group?.at(-1);
    if (group === undefined || last === undefined || bytes + own > most || !fits(last, each)) {
      groups.push([each]);
      bytes = own;
    } else {
      group.push(each);
      bytes += own;
    }
  }
  return groups;
}

/** An update with structs of one client that follow one another, and these deletions. */
function encoded(structs: readonly Struct[], ranges: readonly Range[]): Uint8Array {
  const encoder = new Y.UpdateEncoderV1();
  const { restEncoder } = encoder;
  const [first] = structs;
  encoding.writeVarUint(restEncoder, first === undefined ? 0 : 1);
  if (first !== undefined) {
    encoding.writeVarUint(restEncoder, structs.length);
    encoder.writeClient(first.id.client);
    encoding.writeVarUint(restEncoder, first.id.clock);
    for (const struct of structs) struct.write(encoder, 0);
  }
  const clients = new Map<number, Range[]>();
  for (const range of ranges) {
    const known = clients.get(range.client);
    if (known) known.push(range);
    else clients.set(range.client, [range]);
  }
  encoding.writeVarUint(restEncoder, clients.size);
  for (const [client, deleted] of clients) {
    encoder.resetDsCurVal();
    encoding.writeVarUint(restEncoder, client);
    encoding.writeVarUint(restEncoder, deleted.length);
    for (const { clock, len } of deleted) {
      encoder.writeDsClock(clock);
      encoder.writeDsLen(len);
    }
  }
  return encoder.toUint8Array();
}
