/** Everything that belongs to one open graph. */

import type * as Y from "yjs";
import { undoOf } from "../graph/edit";
import { followGraph, type GraphSource } from "../graph/read";
import { type ConnectOptions, connect, type Room } from "./connect";
import { Following } from "./following";
import { frames } from "./pace";
import { type PresenceSource, presenceOf } from "./presence";

export interface OpenRoom {
  readonly room: Room;
  readonly doc: Y.Doc;
  readonly source: GraphSource;
  readonly presence: PresenceSource;
  readonly following: Following;
  readonly undo: Y.UndoManager;
  /** Calls back with the graph: what the link names is drawn with it. */
  onLink(listener: () => void): () => void;
}

export type Opened = OpenRoom & { leave(): void };

/** Opens a room; `leave` closes all of it. */
export function openRoom(options: ConnectOptions): Opened {
  const room = connect(options);
  const pace = frames();
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
    leave() {
      following.close();
      presence.close();
      source.close();
      undo.destroy();
      room.close();
      pace.close();
    },
  };
}
