/** A room for React: one provider, and hooks that draw again only what changed. */

import {
  createContext,
  type ReactNode,
  useContext,
  useEffect,
  useState,
  useSyncExternalStore,
} from "react";
import type * as Y from "yjs";
import { undoOf } from "../graph/edit";
import { EMPTY_GRAPH, type Graph } from "../graph/model";
import { followGraph, type GraphSource } from "../graph/read";
import { type ConnectOptions, connect, type Link, type Room } from "./connect";
import { type Person, type PresenceSource, presenceOf } from "./presence";

/** Everything that belongs to one open graph. */
export interface OpenRoom {
  readonly room: Room;
  readonly doc: Y.Doc;
  readonly source: GraphSource;
  readonly presence: PresenceSource;
  readonly undo: Y.UndoManager;
}

const RoomContext = createContext<OpenRoom | null>(null);

/** Opens a room without React; `leave` closes all of it. */
export function openRoom(options: ConnectOptions): OpenRoom & { leave(): void } {
  const room = connect(options);
  const source = followGraph(room.doc);
  const presence = presenceOf(room.awareness);
  const undo = undoOf(room.doc);
  return {
    room,
    doc: room.doc,
    source,
    presence,
    undo,
    leave() {
      presence.close();
      source.close();
      undo.destroy();
      room.close();
    },
  };
}

/** Keeps the room at `url` open as long as it is shown. Children see it through the hooks below. */
export function RoomProvider({
  url,
  fallback = null,
  children,
}: {
  readonly url: string;
  /** Shown for the moment in which the room is made. */
  readonly fallback?: ReactNode;
  readonly children: ReactNode;
}) {
  const [open, setOpen] = useState<OpenRoom | null>(null);
  useEffect(() => {
    const fresh = openRoom({ url });
    setOpen(fresh);
    return () => {
      setOpen(null);
      fresh.leave();
    };
  }, [url]);
  return open === null ? fallback : <RoomContext value={open}>{children}</RoomContext>;
}

/** The room around this component. */
export function useRoom(): OpenRoom {
  const open = useContext(RoomContext);
  if (open === null) throw new Error("useRoom needs a RoomProvider around it");
  return open;
}

/** The graph now. Actions and relations that did not change are the same objects as before. */
export function useGraph(): Graph {
  const { source } = useRoom();
  return useSyncExternalStore(source.subscribe, source.graph, () => EMPTY_GRAPH);
}

/** One thing of the graph, say `(graph) => graph.name`; draws again only when it is another. */
export function useGraphPart<T>(part: (graph: Graph) => T): T {
  const { source } = useRoom();
  const get = () => part(source.graph());
  return useSyncExternalStore(source.subscribe, get, get);
}

/** How the page stands with the server, and how many edits are not stored yet. */
export function useLink(): Link {
  const { room } = useRoom();
  return useSyncExternalStore(room.onLink, room.link);
}

/** The others in the room. */
export function usePeople(): readonly Person[] {
  const { presence } = useRoom();
  return useSyncExternalStore(presence.onPeople, presence.people);
}

/** Whether there is something to undo or redo. */
export function useUndo(): { readonly canUndo: boolean; readonly canRedo: boolean } {
  const { undo } = useRoom();
  const [can, setCan] = useState({ canUndo: false, canRedo: false });
  useEffect(() => {
    const look = () => setCan({ canUndo: undo.canUndo(), canRedo: undo.canRedo() });
    const events = ["stack-item-added", "stack-item-popped", "stack-cleared"] as const;
    for (const event of events) undo.on(event, look);
    look();
    return () => {
      for (const event of events) undo.off(event, look);
    };
  }, [undo]);
  return can;
}
