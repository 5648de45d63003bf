/** A room for React: one provider, and hooks that draw again only what changed. */

import {
  createContext,
  type ReactNode,
  useCallback,
  useContext,
  useEffect,
  useMemo,
  useRef,
  useState,
  useSyncExternalStore,
} from "react";
import type * as Y from "yjs";
import { undoOf } from "../graph/edit";
import { EMPTY_GRAPH, type Graph } from "../graph/model";
import { followGraph, type GraphSource } from "../graph/read";
import { type ConnectOptions, connect, type Keep, type Link, type Room } from "./connect";
import { browser, type OtherPerson } from "./device";
import { doorOf } from "./door";
import { applyDifference, type Stranded } from "./history";
import { type Person, type PresenceSource, presenceOf, type View } from "./presence";

/** Everything that belongs to one open graph. */
export interface OpenRoom {
  readonly room: Room;
  readonly doc: Y.Doc;
  readonly source: GraphSource;
  readonly presence: PresenceSource;
  readonly undo: Y.UndoManager;
}

/** What to do about edits that wait on a history which the server has left. */
export interface Choice {
  readonly stranded: Stranded;
  /**
   * Opens the graph as the server has it now, makes the same changes there as one fresh edit, and
   * lets go of the old ones once that is stored. Answers how many keys changed. When it fails, the
   * old ones are still on the device.
   */
  apply(): Promise<number>;
  /** Lets go of the edits and opens the graph as the server has it now. */
  drop(): Promise<void>;
}

interface Held {
  readonly open: OpenRoom;
  readonly keep: Keep | undefined;
  begin(difference: Stranded["difference"] | null): Promise<number>;
}

const RoomContext = createContext<Held | null>(null);

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

type Opened = ReturnType<typeof openRoom>;

/**
 * Keeps the room at `url` open as long as it is shown. Children see it through the hooks below.
 * With `keep`, edits that wait survive closing the page, for that person only.
 */
export function RoomProvider({
  url,
  keep: given,
  fallback = null,
  children,
}: {
  readonly url: string;
  readonly keep?: Keep;
  /** Shown for the moment in which the room is made. */
  readonly fallback?: ReactNode;
  readonly children: ReactNode;
}) {
  const [open, setOpen] = useState<Opened | null>(null);
  const keep = useSteady(given);
  const now = useRef<Opened | null>(null);
  const enter = useCallback(
    (anew: boolean): Opened => {
      const fresh = openRoom({
        url,
        ...(keep && { keep: { ...keep, anew }, admit: doorOf(keep.graph, keep.person.id) }),
      });
      now.current = fresh;
      setOpen(fresh);
      return fresh;
    },
    [url, keep],
  );
  useEffect(() => {
    enter(false);
    return () => {
      now.current?.leave();
      now.current = null;
      setOpen(null);
    };
  }, [enter]);
  useEffect(() => {
    const onLeave = (event: BeforeUnloadEvent) => {
      const link = now.current?.room.link();
      if (link && link.unsaved > 0 && !link.kept) event.preventDefault();
    };
    window.addEventListener("beforeunload", onLeave);
    return () => window.removeEventListener("beforeunload", onLeave);
  }, []);
  const begin = useCallback(
    async (difference: Stranded["difference"] | null) => {
      const old = now.current;
      if (old === null) return 0;
      if (difference === null) {
        await old.room.forget();
        old.leave();
        enter(false);
        return 0;
      }
      const { room, doc } = enter(true);
      try {
        await room.settled(untilRefused(room));
        const changed = applyDifference(doc, difference);
        await room.settled(untilRefused(room));
        await old.room.forget();
        return changed;
      } finally {
        old.leave();
      }
    },
    [enter],
  );
  const held = useMemo(() => open && { open, keep, begin }, [open, keep, begin]);
  return held === null ? fallback : <RoomContext value={held}>{children}</RoomContext>;
}

/** The same object as long as graph and person are the same; the name in it is the newest. */
function useSteady(keep: Keep | undefined): Keep | undefined {
  const { graph, device, person } = keep ?? {};
  const id = person?.id;
  const name = useRef("");
  name.current = person?.name ?? "";
  return useMemo(() => {
    if (graph === undefined || id === undefined) return undefined;
    const latest = {
      id,
      get name() {
        return name.current;
      },
    };
    return { graph, person: latest, ...(device && { device }) };
  }, [graph, device, id]);
}

/** Aborts when a room is refused. */
function untilRefused(room: Room): AbortSignal {
  const controller = new AbortController();
  const stop = room.onLink(() => {
    const { state, why } = room.link();
    if (state !== "refused") return;
    controller.abort(new Error(`the room is closed: ${why}`));
    stop();
  });
  return controller.signal;
}

function useHeld(): Held {
  const held = useContext(RoomContext);
  if (held === null) throw new Error("useRoom needs a RoomProvider around it");
  return held;
}

/** The room around this component. */
export function useRoom(): OpenRoom {
  return useHeld().open;
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

/** The others who edit one field, `<key>|<field>`. */
export function useEditors(field: string): readonly Person[] {
  const people = usePeople();
  return useMemo(
    () => people.filter(({ presence }) => presence.editing === field),
    [people, field],
  );
}

/** What another page shows, to go where it goes; null when it says nothing or has left. */
export function useViewOf(client: number | null): View | null {
  return usePeople().find((person) => person.client === client)?.presence.view ?? null;
}

/** What there is to decide about edits that wait on another history; null when nothing is. */
export function useChoice(): Choice | null {
  const { open, begin } = useHeld();
  const { why } = useLink();
  return useMemo(() => {
    const stranded = why === "other-epoch" ? open.room.stranded() : null;
    if (stranded === null) return null;
    return {
      stranded,
      apply: () => begin(stranded.difference),
      drop: async () => void (await begin(null)),
    };
  }, [open, begin, why]);
}

const NOBODY: readonly OtherPerson[] = [];

/** The others whose edits of this graph wait on this device until they sign in again. */
export function useOthersWaiting(): readonly OtherPerson[] {
  const { keep } = useHeld();
  const [others, setOthers] = useState(NOBODY);
  useEffect(() => {
    if (keep === undefined) return;
    let gone = false;
    const device = keep.device ?? browser();
    device.others(keep).then(
      (found) => !gone && setOthers(found),
      () => !gone && setOthers(NOBODY), // a device that keeps nothing keeps nobody's
    );
    return () => {
      gone = true;
    };
  }, [keep]);
  return others;
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
