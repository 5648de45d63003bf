/**
 * The page's connection to a graph: one room, and the next one when the server changes its history.
 *
 * A room whose history the server has left is followed by one that shows what the server has now;
 * edits that wait on the old one are laid aside for the person to decide about, never merged. A page
 * that shows something else than the server, or whose client id is somebody else's, begins anew too.
 * Works without React.
 */

import { admissionCheck } from "./admission";
import {
  browserStore,
  type EditStore,
  epochName,
  idOf,
  newEpoch,
  type StoredCopy,
} from "./indexed-db";
import { type ClosableRoom, type OpenRoom, openRoom } from "./open-room";
import {
  applyDifference,
  type DocumentDifference,
  type StrandedEdits,
  strandedEditsOf,
} from "./replaced-history";
import type { RefusalReason, Room, RoomLink } from "./room";
import type { PersistenceOptions, RoomOptions } from "./room-connection";

/** What the page may say softly about a room that follows another. */
export type ConnectionNotice = "went-back" | "differed";

export interface GraphConnectionState {
  readonly open: OpenRoom;
  /** Edits on histories that the server has left, the oldest first. */
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
  /** Whether the device has them, so that they outlive this page. */
  isKept(): boolean;
  /** Lets go of them on the device. */
  forget(): Promise<void>;
}

/** A document that differs so often has a fault that opening anew does not mend. */
const MOST_DIFFERENCES = 3;

/** Left, with edits that no server and no device has yet. */
const lingering = new Set<GraphConnection>();

/** Whether edits would be lost if the page were closed now, in this graph or in one that was left. */
export function wouldLose(connection: GraphConnection | undefined): boolean {
  return lingering.size > 0 || connection?.wouldLose() === true;
}

export class GraphConnection {
  private readonly options: GraphConnectionOptions;
  private readonly listeners = new Set<() => void>();
  private opened: ClosableRoom;
  private asides: readonly StrandedEpoch[] = [];
  private notice: ConnectionNotice | null = null;
  private current: GraphConnectionState;
  private unfollow: () => void = () => undefined;
  private looked = false;
  private differences = 0;
  private left = false;

  constructor(options: GraphConnectionOptions) {
    this.options = options;
    this.opened = this.enter(options.keep);
    this.current = { open: this.opened, stranded: [], notice: null };
  }

  /** The same object until something of it changes. */
  readonly now = (): GraphConnectionState => this.current;

  readonly onChange = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  /**
   * Makes these changes in the graph as the server has it now, as one edit that can be undone, and
   * lets go of the old edits once that is stored. Answers how many keys changed. When it fails, the
   * old edits are where they were.
   */
  async apply(stranded: StrandedEdits, difference: DocumentDifference): Promise<number> {
    const { room, doc } = this.opened;
    await room.settled(untilRefused(room));
    const changed = applyDifference(doc, difference);
    await room.settled(untilRefused(room));
    await this.drop(stranded);
    return changed;
  }

  /** Lets go of these edits. */
  async drop(stranded: StrandedEdits): Promise<void> {
    const aside = this.asides.find((each) => each.stranded === stranded);
    await aside?.forget();
    this.asides = this.asides.filter((each) => each !== aside);
    this.say();
    await this.lookAside(); // another page may have left some on the same history
  }

  /** The notice was read. */
  dismiss(): void {
    this.notice = null;
    this.say();
  }

  /** Whether closing the page now would lose edits. */
  wouldLose(): boolean {
    return isAtRisk(this.opened.room) || this.asides.some((aside) => !aside.isKept());
  }

  /** Where nothing else has the edits that wait, the room stays open until they are stored. */
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
    else if (state === "live" && !this.looked) void this.lookAside();
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
        if (aside !== null) this.asides = [...this.asides, aside];
        else this.notice = "went-back";
        this.follower(otherEpoch(room));
        break;
      case "other-client":
        this.follower(newEpoch(room.histories().theirs));
        if (aside === null) void room.forget();
        else void this.again(aside);
        break;
      case "differs":
        this.differences += 1;
        if (this.differences > MOST_DIFFERENCES) return;
        this.notice = "differed";
        this.follower(newEpoch(room.histories().theirs));
        void room.forget();
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

  /** The same history under another client id: the same changes, without asking. */
  private async again(aside: StrandedEpoch): Promise<void> {
    this.asides = [...this.asides, aside];
    await this.apply(aside.stranded, aside.stranded.difference).catch((error: unknown) => {
      console.warn("Changes wait for a decision, since they could not be made again:", error);
    });
  }

  /** Edits that were laid aside when this graph was open here before. */
  private async lookAside(): Promise<void> {
    this.looked = true;
    const { keep } = this.options;
    if (keep === undefined) return;
    const device = keep.device ?? browserStore();
    const here = this.opened.room.histories().here;
    const all = await device.read(keep).catch(() => []); // a device that keeps nothing
    if (this.left) return;
    const known = new Set([here, ...this.asides.map(({ epoch }) => epoch)]);
    const found = all
      .filter(({ epoch, waiting }) => !known.has(epoch) && waiting.length > 0)
      .map((kept) => asideOf(device, keep, kept));
    if (found.length === 0) return;
    this.asides = [...found, ...this.asides];
    this.say();
  }

  private say(): void {
    const stranded = this.asides.map((aside) => aside.stranded);
    this.current = { open: this.opened, stranded, notice: this.notice };
    for (const listener of [...this.listeners]) listener();
  }
}

function asideOf(device: EditStore, keep: PersistenceOptions, kept: StoredCopy): StrandedEpoch {
  const { epoch, waiting } = kept;
  return {
    epoch,
    stranded: strandedEditsOf(kept),
    isKept: () => true,
    forget: () => device.forget(keep, epoch, waiting.map(idOf)),
  };
}

/** Whether it has edits that neither the server nor this device has. */
function isAtRisk(room: Room): boolean {
  const { unsaved, kept } = room.link();
  return unsaved > 0 && kept !== true;
}

/** Whether they may still be stored without anybody looking at the room. */
function mayBeStored(room: Room): boolean {
  return isAtRisk(room) && room.link().state !== "refused";
}

/** Where to keep what the server has now: under its name, unless that is the name of what was. */
function otherEpoch(room: Room): string {
  const { here, theirs } = room.histories();
  return theirs !== "" && theirs !== epochName(here) ? theirs : newEpoch(theirs);
}

/** Aborts when a room is refused. */
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
