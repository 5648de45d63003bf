/** Opens a graph: its room, and what reads and follows the room (graph, people, undo). */

import type * as Y from "yjs";
import { undoOf } from "../graph/edit";
import type { UndoHistory } from "../graph/edit/undo-history";
import { followGraph, type GraphSource } from "../graph/read";
import { isEqual } from "../graph/values";
import { frameScheduler } from "./presence/frame-scheduler";
import { FollowedPerson, type PresenceSource, presenceOf } from "./presence/presence";
import { connectRoom, type Room, type RoomOptions } from "./room-connection";

export interface OpenRoom {
  readonly room: Room;
  readonly doc: Y.Doc;
  readonly source: GraphSource;
  readonly presence: PresenceSource;
  readonly following: FollowedPerson;
  readonly undo: UndoHistory;
  /** Calls back with the graph: what the link names is drawn with it. */
  onLink(listener: () => void): () => void;
  /** The graph and the link for what need not keep up with the hands of others. */
  readonly throttled: {
    onGraph(listener: () => void): () => void;
    onLink(listener: () => void): () => void;
  };
}

export type ClosableRoom = OpenRoom & { leave(): void };

const THROTTLE_MS = 250;

/** Opens a room; `leave` closes all of it. */
export function openRoom(options: RoomOptions): ClosableRoom {
  const room = connectRoom(options);
  const scheduler = frameScheduler();
  const slowScheduler = frameScheduler(THROTTLE_MS);
  const source = followGraph(room.doc, scheduler.soon);
  const presence = presenceOf(room.awareness, scheduler.soon);
  const following = new FollowedPerson(presence);
  const undo = undoOf(room.doc);
  return {
    room,
    doc: room.doc,
    source,
    presence,
    following,
    undo,
    onLink(listener) {
      const tell = () => listener();
      return room.onLink(() => scheduler.soon(tell));
    },
    throttled: {
      onGraph: (listener) =>
        source.subscribe((own) => (own ? listener() : slowScheduler.soon(listener))),
      onLink(listener) {
        let last = room.link();
        return room.onLink(() => {
          const link = room.link();
          // Each edit of anybody has a place in the log; all else is news.
          const named = isEqual({ ...last, seq: 0 }, { ...link, seq: 0 });
          last = link;
          (named ? slowScheduler : scheduler).soon(listener);
        });
      },
    },
    leave() {
      following.close();
      presence.close();
      source.close();
      undo.destroy();
      room.close();
      scheduler.close();
      slowScheduler.close();
    },
  };
}
