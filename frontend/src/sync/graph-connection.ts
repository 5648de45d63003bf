/**
 * The page's connection to a graph: one room, and the next one when the server changes its history.
 *
 * A room whose history the server has left is followed by one that shows what the server has now;
 * edits that wait on the old one are laid aside for the person to decide about, never merged. A page
 * that shows something else than the server, or whose client id is somebody else's, begins anew too,
 * and so does one of whose edits the server has refused: everything else of its person is stored.
 * Works without React.
 */

import { editor } from "../api/client";
import { isProxyFault, Refusal, storageFault } from "../api/http";
import { currentPerson } from "../api/session";
import {
  browserStore,
  type EditStore,
  epochName,
  idOf,
  newEpoch,
  type StoredCopy,
  type UnsavedEdit,
} from "./indexed-db";
import { type ClosableRoom, type OpenRoom, openRoom } from "./open-room";
import {
  applyDifference,
  type DocumentDifference,
  fitsWhole,
  type StrandedEdits,
  strandedEditsIn,
  strandedEditsOf,
} from "./replaced-history";
import { type AdmissionCheck, Away, type Room, type RoomLink } from "./room";
import type { PersistenceOptions, RefusalReason, RoomOptions } from "./room-connection";

/** An event of the connection that the page shows as a notice, without asking for anything. */
export type ConnectionNotice = "went-back" | "differed";

export interface GraphConnectionState {
  readonly open: OpenRoom;
  /** Edits that the server does not take as they are, the oldest first. */
  readonly stranded: readonly StrandedEdits[];
  readonly notice: ConnectionNotice | null;
}

export interface GraphConnectionOptions {
  readonly url: string;
  readonly keep?: PersistenceOptions;
  readonly open?: RoomOptions["open"];
}

interface StrandedEpoch {
  readonly epoch: string;
  readonly stranded: StrandedEdits;
  /** Returns true if the device has stored them, so that they survive this page. */
  isKept(): boolean;
  /** Deletes them on the device. */
  forget(): Promise<void>;
}

/** After so many differences the document has a fault that reopening does not mend. */
const MOST_DIFFERENCES = 3;

/** Left, with edits that no server and no device has yet. */
const lingering = new Set<GraphConnection>();

/** Returns true if closing the page now would lose edits of this graph or of one that was left. */
export function wouldLose(connection: GraphConnection | undefined): boolean {
  return lingering.size > 0 || connection?.wouldLose() === true;
}

export class GraphConnection {
  private readonly options: GraphConnectionOptions;
  private readonly listeners = new Set<() => void>();
  private opened: ClosableRoom;
  private strandedEpochs: readonly StrandedEpoch[] = [];
  private notice: ConnectionNotice | null = null;
  private current: GraphConnectionState;
  private unfollow: () => void = () => undefined;
  private looked = false;
  private differences = 0;
  private left = false;
  /** The edit that is made to see whether the server takes it; what it is made from is kept elsewhere. */
  private trial: UnsavedEdit | null = null;
  /** Rooms with edits that are being made anew. */
  private readonly refusedRooms = new Set<Room>();
  private makingAnew: Promise<void> = Promise.resolve();

  constructor(options: GraphConnectionOptions) {
    this.options = options;
    this.opened = this.enter(options.keep);
    this.current = { open: this.opened, stranded: [], notice: null };
  }

  /** Returns the state: the same object until a part of it changes. */
  readonly now = (): GraphConnectionState => this.current;

  readonly onChange = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  /**
   * Makes these changes in the graph as the server has it now, as one edit that can be undone, and
   * lets go of the old edits once that is stored. Returns how many keys changed. When it fails, the
   * old edits are where they were.
   */
  async apply(stranded: StrandedEdits, difference: DocumentDifference): Promise<number> {
    await this.makingAnew;
    const changed = await this.make(difference);
    await this.drop(stranded);
    return changed;
  }

  /** Drops these edits. */
  async drop(stranded: StrandedEdits): Promise<void> {
    const aside = this.strandedEpochs.find((each) => each.stranded === stranded);
    await aside?.forget();
    this.strandedEpochs = this.strandedEpochs.filter((each) => each !== aside);
    this.say();
    await this.loadStrandedEpochs(); // another page may have left some on the same history
  }

  /** Hides the notice that the person has read. */
  dismiss(): void {
    this.notice = null;
    this.say();
  }

  /** Returns true if closing the page now would lose edits. */
  wouldLose(): boolean {
    const rooms = [this.opened.room, ...this.refusedRooms];
    return rooms.some(isAtRisk) || this.strandedEpochs.some((aside) => !aside.isKept());
  }

  /** Leaves the graph. If waiting edits exist only here, the room stays open until they are stored. */
  leave(): void {
    if (this.left) return;
    this.left = true;
    this.unfollow();
    this.listeners.clear();
    const { opened } = this;
    const { room } = opened;
    if (!mayBeStored(room)) {
      opened.leave();
      return;
    }
    lingering.add(this);
    room.awareness.setLocalState(null); // nobody looks at it any more
    const stop = room.onLink(() => {
      if (mayBeStored(room)) return;
      stop();
      lingering.delete(this);
      opened.leave();
    });
  }

  private enter(keep: PersistenceOptions | undefined): ClosableRoom {
    const { url, open } = this.options;
    const opened = openRoom({
      url,
      ...(open && { open }),
      ...(keep && { keep, admit: admissionCheck(keep.graph, keep.person.id) }),
    });
    this.unfollow();
    this.unfollow = opened.room.onLink(() => this.follow(opened.room.link()));
    return opened;
  }

  private follow({ state, why }: RoomLink): void {
    if (state === "refused" && why !== undefined) this.succeed(why);
    else if (state === "live" && !this.looked) void this.loadStrandedEpochs();
  }

  /** Opens the next room, if this one ended for a reason that the next one has not. */
  private succeed(why: RefusalReason): void {
    const { room } = this.opened;
    const stranded = room.stranded();
    const epoch = room.histories().here;
    const isKept = () => room.link().kept === true;
    const aside = stranded && { epoch, stranded, isKept, forget: () => room.forget() };
    switch (why) {
      case "other-epoch":
        if (aside !== null) this.strandedEpochs = [...this.strandedEpochs, aside];
        else this.notice = "went-back";
        this.follower(otherEpoch(room));
        break;
      case "other-client":
        this.followerWithChoices(room);
        if (aside === null) void room.forget();
        else void this.makeUnderOtherClient(aside);
        break;
      case "differs":
        this.differences += 1;
        if (this.differences > MOST_DIFFERENCES) return;
        this.notice = "differed";
        this.followerWithChoices(room);
        void room.forget();
        break;
      case "not-accepted":
      case "full":
        if (!this.goOn(why)) return;
        break;
      default:
        return; // the person can do something about it, and this room goes on then
    }
    this.say();
  }

  private follower(epoch: string): void {
    const old = this.opened;
    const { keep } = this.options;
    this.opened = this.enter(keep && { ...keep, epoch });
    old.leave();
  }

  /** Opens a room on the same history. The choices that the person has not made yet are about it, too. */
  private followerWithChoices(room: Room): void {
    const choices = room.changedTwice.undecided();
    this.follower(newEpoch(room.histories().theirs));
    this.opened.room.changedTwice.restore({ choices });
  }

  /**
   * Opens the next room after a refusal. The edits that waited are made anew there, each by itself, so
   * that only what is refused by itself is laid aside. False when that has been of no use before.
   */
  private goOn(why: "not-accepted" | "full"): boolean {
    const { room } = this.opened;
    const { trial } = this;
    const waiting = room.waiting().filter((edit) => edit !== trial);
    if (room.waiting().length === 0) {
      this.differences += 1;
      if (this.differences > MOST_DIFFERENCES) return false;
    }
    this.followerWithChoices(room);
    if (waiting.length === 0) {
      void room.forget();
      return true;
    }
    this.refusedRooms.add(room);
    const isKnown = waiting.length === 1 && trial === null;
    this.makingAnew = this.makingAnew.then(async () => {
      if (trial !== null) await room.forget([trial]);
      const left = isKnown ? waiting : await this.makeAnew(room, waiting);
      this.refusedRooms.delete(room);
      if (left.length > 0) this.layAside(room, left, why);
      else if (!this.left) await room.forget();
    });
    return true;
  }

  /** Makes each of these edits in the newest room. Returns those that are not taken. */
  private async makeAnew(room: Room, edits: readonly UnsavedEdit[]): Promise<UnsavedEdit[]> {
    const left: UnsavedEdit[] = [];
    for (const edit of edits) {
      const { difference } = strandedEditsIn(room.doc, [edit]);
      // An edit that builds on a refused one waits with it.
      const stored = await this.make(difference, fitsWhole).then(
        (changed) => changed !== null,
        () => false,
      );
      if (this.left) return [];
      if (stored) await room.forget([edit]);
      else left.push(edit);
    }
    return left;
  }

  private layAside(
    room: Room,
    edits: readonly UnsavedEdit[],
    refused: "not-accepted" | "full",
  ): void {
    const aside: StrandedEpoch = {
      epoch: room.histories().here,
      stranded: { ...strandedEditsIn(room.doc, edits), refused },
      isKept: () => room.link().kept === true,
      forget: () => room.forget(),
    };
    this.strandedEpochs = [...this.strandedEpochs, aside];
    this.say();
  }

  /** Makes these changes as one edit, unless they do not fit, and waits until it is stored. Rejects
   * when it is refused. Returns how many keys changed. */
  private async make(difference: DocumentDifference): Promise<number>;
  private async make(
    difference: DocumentDifference,
    fits: typeof fitsWhole,
  ): Promise<number | null>;
  private async make(
    difference: DocumentDifference,
    fits: typeof fitsWhole = () => true,
  ): Promise<number | null> {
    const { room, doc } = this.opened;
    await room.settled(untilRefused(room));
    if (!fits(doc, difference)) return null;
    const changed = applyDifference(doc, difference);
    this.trial = changed > 0 ? (room.waiting().at(-1) ?? null) : null;
    try {
      await room.settled(untilRefused(room));
    } finally {
      this.trial = null;
    }
    return changed;
  }

  /** Makes the waiting edits anew under another client id, in the same history and without asking. */
  private async makeUnderOtherClient(aside: StrandedEpoch): Promise<void> {
    this.strandedEpochs = [...this.strandedEpochs, aside];
    await this.apply(aside.stranded, aside.stranded.difference).catch((error: unknown) => {
      console.warn("Changes wait for a decision, since they could not be made again:", error);
    });
  }

  /** Looks for edits that were laid aside when this graph was open here before. */
  private async loadStrandedEpochs(): Promise<void> {
    this.looked = true;
    const { keep } = this.options;
    if (keep === undefined) return;
    const device = keep.device ?? browserStore();
    const here = this.opened.room.histories().here;
    const all = await device.read(keep).catch(() => []); // a device that keeps nothing
    if (this.left) return;
    const busy = [...this.refusedRooms].map((room) => room.histories().here);
    const known = new Set([here, ...busy, ...this.strandedEpochs.map(({ epoch }) => epoch)]);
    const found = all
      .filter(({ epoch, waiting }) => !known.has(epoch) && waiting.length > 0)
      .map((kept) => strandedEpochOf(device, keep, kept, here));
    if (found.length === 0) return;
    this.strandedEpochs = [...found, ...this.strandedEpochs];
    this.say();
  }

  private say(): void {
    const stranded = this.strandedEpochs.map((aside) => aside.stranded);
    this.current = { open: this.opened, stranded, notice: this.notice };
    for (const listener of [...this.listeners]) listener();
  }
}

/** `here`: the history that is shown now. Where the server calls both the same, it refused the edits. */
function strandedEpochOf(
  device: EditStore,
  keep: PersistenceOptions,
  kept: StoredCopy,
  here: string,
): StrandedEpoch {
  const { epoch, waiting } = kept;
  const refused = epochName(epoch) === epochName(here) ? "not-accepted" : null;
  return {
    epoch,
    stranded: { ...strandedEditsOf(kept), ...(refused && { refused }) },
    isKept: () => true,
    forget: () => device.forget(keep, epoch, waiting.map(idOf)),
  };
}

/** Returns true if the room has edits that neither the server nor this device has stored. */
function isAtRisk(room: Room): boolean {
  const { unsaved, kept } = room.link();
  return unsaved > 0 && kept !== true;
}

/** Returns true if its edits may still be stored without anybody opening the room. */
function mayBeStored(room: Room): boolean {
  return isAtRisk(room) && room.link().state !== "refused";
}

/**
 * Returns the epoch under which the server's present history is kept: its own name, unless the old copy has that
 * name.
 */
function otherEpoch(room: Room): string {
  const { here, theirs } = room.histories();
  return theirs !== "" && theirs !== epochName(here) ? theirs : newEpoch(theirs);
}

/** Returns a signal that aborts when the room is refused. */
function untilRefused(room: Room): AbortSignal {
  const controller = new AbortController();
  const look = () => {
    const { state, why } = room.link();
    if (state !== "refused") return;
    controller.abort(new Error(`the room is closed: ${why}`));
    stop();
  };
  const stop = room.onLink(look);
  look();
  return controller.signal;
}

/**
 * Returns the `admit` of a room: it asks the server who this browser is, and, if edits wait, whether it can store.
 * Rejects with `Unreachable` when nobody answers, with `Away` when the proxy or the database is at fault.
 */
function admissionCheck(graph: string, person: string): AdmissionCheck {
  return async (again, hasWork) => {
    try {
      const here = await currentPerson();
      if (here.id !== person) return "other-person";
      if (again) await editor.get("/api/graphs/{graph_id}", { path: { graph_id: graph } });
      const lack = again && hasWork ? await storageFault() : null;
      if (lack !== null) throw new Away("not-stored", lack);
      return null;
    } catch (error) {
      if (!(error instanceof Refusal)) throw error;
      const why = REASONS.get(error.details.status);
      if (why !== undefined) return why;
      if (isProxyFault(error)) throw new Away("proxy", error.message);
      throw error.details.status === 503 ? new Away("not-stored", error.message) : error;
    }
  };
}

const REASONS: ReadonlyMap<number, RefusalReason> = new Map([
  [401, "session-ended"],
  [403, "forbidden"],
  [404, "no-such-graph"],
  [410, "no-such-graph"],
]);
