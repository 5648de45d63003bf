/** Everything that belongs to one open graph. */

import type * as Y from "yjs";
import { undoOf } from "../graph/edit";
import { same } from "../graph/equal";
import { followGraph, type GraphSource } from "../graph/read";
import { Following } from "./presence/following";
import { frames } from "./presence/frame-scheduler";
import { type PresenceSource, presenceOf } from "./presence/presence";
import { type ConnectOptions, connect, type Room } from "./room-connection";

export interface OpenRoom {
  readonly room: Room;
  readonly doc: Y.Doc;
  readonly source: GraphSource;
  readonly presence: PresenceSource;
  readonly following: Following;
  readonly undo: Y.UndoManager;
  /** Calls back with the graph: what the link names is drawn with it. */
  onLink(listener: () => void): () => void;
  /** The graph and the link for what need not keep up with the hands of others. */
  readonly calm: {
    onGraph(listener: () => void): () => void;
    onLink(listener: () => void): () => void;
  };
}

export type Opened = OpenRoom & { leave(): void };

const CALM_MS = 250;

/** Opens a room; `leave` closes all of it. */
export function openRoom(options: ConnectOptions): Opened {
  const room = connect(options);
  const pace = frames();
  const calm = frames(CALM_MS);
  const source = followGraph(room.doc, pace.soon);
  const presence = presenceOf(room.awareness, pace.soon);
  const following = new Following(presence);
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
      return room.onLink(() => pace.soon(tell));
    },
    calm: {
      onGraph: (listener) => source.subscribe((own) => (own ? listener() : calm.soon(listener))),
      onLink(listener) {
        let last = room.link();
        return room.onLink(() => {
          const link = room.link();
          // Each edit of anybody has a place in the log; all else is news.
          const named = same({ ...last, seq: 0 }, { ...link, seq: 0 });
          last = link;
          (named ? calm : pace).soon(listener);
        });
      },
    },
    leave() {
      following.close();
      presence.close();
      source.close();
      undo.destroy();
      room.close();
      pace.close();
      calm.close();
    },
  };
}
