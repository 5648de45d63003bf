/** The interface of a room, and the options to open one. */

import type { Awareness } from "y-protocols/awareness";
import type * as Y from "yjs";
import { serverPath } from "../api/page-url";
import type { ChangedTwiceStore } from "./changed-twice";
import type { CopyOwner, EditStore, UnsavedEdit } from "./indexed-db";
import type { StrandedEdits } from "./replaced-history";

/** The reasons for which the server refuses a page or closes its socket. */
export type RefusalReason =
  | "session-ended"
  | "other-person"
  | "forbidden"
  | "no-such-graph"
  | "other-epoch"
  | "other-client"
  | "differs"
  | "full"
  | "not-accepted"
  | "restarting"
  | "too-slow"
  | "no-network"
  | "proxy"
  | "not-stored"
  | "no-socket";

export interface RoomLink {
  /** `refused` does not come back by itself: see `why` and `reconnect`. */
  readonly state: "connecting" | "live" | "offline" | "refused";
  readonly why?: RefusalReason;
  /** The words of the server, or about its proxy, that say more than `why` does. */
  readonly said?: string;
  /** The number of edits of this person that are not durable yet. */
  readonly unsaved: number;
  /** True if those edits survive closing this page. Absent for a room that keeps nothing. */
  readonly kept?: boolean;
  /** A sentence of the server that says why nobody may change this graph now; absent when it may be changed. */
  readonly readOnly?: string;
  /** The page shows the log up to this entry, plus what is `unsaved`. 0 before the first sync. */
  readonly seq: number;
}

export interface Room {
  readonly doc: Y.Doc;
  readonly awareness: Awareness;
  /** Choices between values that this person and others set without receiving each other's edit. */
  readonly changedTwice: ChangedTwiceStore;
  /** Returns the state of the connection: the same object until a part of it changes. */
  link(): RoomLink;
  onLink(listener: () => void): () => void;
  /** Resolves with `seq` once everything is stored; rejects when the room closes or `signal` aborts. */
  settled(signal?: AbortSignal): Promise<number>;
  /** Resolves once the page shows the log up to `seq`, or is not connected. */
  shows(seq: number): Promise<void>;
  /** Connects at once, also after a refusal (when the person has signed in again, for example). */
  reconnect(): void;
  /**
   * Returns the name of the history that is kept here, and of the one that the server named last; empty when
   * unknown.
   */
  histories(): { readonly here: string; readonly theirs: string };
  /** Returns the edits that are not durable, in the order in which they were made. */
  waiting(): readonly UnsavedEdit[];
  /** Returns the edits that are not durable as values; null when there are none. */
  stranded(): StrandedEdits | null;
  /**
   * Forgets these of the edits that wait, all of them unless it is said which; with the last of them what
   * is kept here of this history, unless another page's wait too.
   */
  forget(edits?: readonly UnsavedEdit[]): Promise<void>;
  /** Leaves the room. Edits that were not stored stay in `doc`, and on the device if there is one. */
  close(): void;
}

/** The part of `WebSocket` that a room uses, so that tests can bring their own. */
export interface Socket {
  binaryType: BinaryType;
  readonly readyState: number;
  onopen: (() => void) | null;
  onmessage: ((event: { data: unknown }) => void) | null;
  onclose: ((event: { code: number; reason?: string }) => void) | null;
  onerror: (() => void) | null;
  send(data: Uint8Array<ArrayBuffer>): void;
  close(code?: number): void;
}

export interface RoomOptions {
  /** The address `wss://host/api/graphs/ID/room`, see `roomUrl`. */
  readonly url: string;
  readonly doc?: Y.Doc;
  /** Opens a socket; the browser's by default. */
  readonly open?: (url: string) => Socket;
  /** 0 … 1, for the spread of reconnects. */
  readonly random?: () => number;
  /** Keeps the graph and the edits that wait on this device, for this person only. */
  readonly keep?: PersistenceOptions;
  /**
   * Called before each attempt; returns a reason not to enter, or null. A browser cannot tell a refused upgrade
   * from a dead server, nor whose cookie an upgrade carries. `again` is true after an attempt or a connection
   * broke off; `hasWork` if edits wait. Rejects when nobody can be asked now, with `Away` when it is known why.
   */
  readonly admit?: AdmissionCheck;
}

export type AdmissionCheck = (again: boolean, hasWork: boolean) => Promise<RefusalReason | null>;

/** The server cannot be used at the moment, for a known reason: another attempt follows. */
export class Away extends Error {
  readonly why: RefusalReason;
  constructor(why: RefusalReason, said: string) {
    super(said);
    this.name = "Away";
    this.why = why;
  }
}

export interface PersistenceOptions extends CopyOwner {
  /** The browser's storage by default. */
  readonly device?: EditStore;
  /** Only this history: what is kept of others stays where it is and is not shown. */
  readonly epoch?: string;
}

/** Returns the address of a graph's room on the server that the page came from. */
export function roomUrl(graph: string, from: string | URL = window.location.href): string {
  const url = new URL(serverPath(`/api/graphs/${encodeURIComponent(graph)}/room`), from);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return url.href;
}
