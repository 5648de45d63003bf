/** A room for React: one provider, and hooks that draw again only what changed. */

import { useQueryClient } from "@tanstack/react-query";
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
import { type Colored, colorsOf, useKnownPeople } from "../api/people";
import { EMPTY_GRAPH, type Graph } from "../graph/model";
import { isEqual } from "../graph/values";
import {
  type ConnectionNotice,
  GraphConnection,
  type GraphConnectionState,
  wouldLose,
} from "./graph-connection";
import { browserStore, type ChangedTwice, idOf, type OtherPerson } from "./indexed-db";
import type { OpenRoom } from "./open-room";
import type { Participant } from "./presence/presence";
import { type StrandedEdits, strandedEditsOf } from "./replaced-history";
import type { PersistenceOptions, RoomLink } from "./room-connection";

export type { OpenRoom } from "./open-room";

/** The person's decision about edits that wait on a history which the server has left. */
export interface StrandedEditsChoice {
  readonly stranded: StrandedEdits;
  /** Makes the chosen changes in the present graph, and drops the rest once these are stored. */
  apply(chosen: StrandedEdits["difference"]): Promise<number>;
  /** Drops the edits. */
  drop(): Promise<void>;
}

interface RoomContextValue {
  readonly connection: GraphConnection;
  readonly connectionState: GraphConnectionState;
  readonly keep: PersistenceOptions | undefined;
}

const RoomContext = createContext<RoomContextValue | null>(null);

/**
 * Keeps the room at `url` open while it is mounted. Children use it through the hooks below. With `keep`, waiting
 * edits survive closing the page, for that person only.
 */
export function RoomProvider({
  url,
  keep: given,
  fallback = null,
  children,
}: {
  readonly url: string;
  readonly keep?: PersistenceOptions;
  /** Shown for the moment in which the room is made. */
  readonly fallback?: ReactNode;
  readonly children: ReactNode;
}) {
  const keep = useStablePersistence(given);
  const [roomContext, setHeld] = useState<RoomContextValue | null>(null);
  useEffect(() => {
    const connection = new GraphConnection({ url, ...(keep && { keep }) });
    const show = () => setHeld({ connection, connectionState: connection.now(), keep });
    const stop = connection.onChange(show);
    show();
    return () => {
      stop();
      connection.leave();
      setHeld(null);
    };
  }, [url, keep]);
  useBeforeLeaving(roomContext);
  return roomContext === null ? (
    fallback
  ) : (
    <RoomContext value={roomContext}>{children}</RoomContext>
  );
}

/** Asks before the page is closed, when something would be lost by that. */
function useBeforeLeaving(roomContext: RoomContextValue | null): void {
  const connection = roomContext?.connection;
  useEffect(() => {
    const onLeave = (event: BeforeUnloadEvent) => {
      if (wouldLose(connection)) event.preventDefault();
    };
    window.addEventListener("beforeunload", onLeave);
    return () => window.removeEventListener("beforeunload", onLeave);
  }, [connection]);
}

/** Returns the same options as long as graph and person are the same, with the newest name in them. */
function useStablePersistence(
  keep: PersistenceOptions | undefined,
): PersistenceOptions | undefined {
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

function useRoomContext(): RoomContextValue {
  const roomContext = useContext(RoomContext);
  if (roomContext === null) throw new Error("useRoom needs a RoomProvider around it");
  return roomContext;
}

/** The room around this component. */
export function useRoom(): OpenRoom {
  return useRoomContext().connectionState.open;
}

/** The name of the person at this page; empty in a room that keeps nothing. */
export function useMyName(): string {
  return useRoomContext().keep?.person.name ?? "";
}

/** The graph now. Actions and relations that did not change are the same objects as before. */
export function useGraph(): Graph {
  const { source } = useRoom();
  return useSyncExternalStore(source.subscribe, source.graph, () => EMPTY_GRAPH);
}

/** Returns the graph for parts beside the canvas: own edits at once, those of others some times a second. */
export function useThrottledGraph(): Graph {
  const { source, throttled: calm } = useRoom();
  return useSyncExternalStore(calm.onGraph, source.graph, () => EMPTY_GRAPH);
}

/** Return a part of the graph, say `(graph) => graph.name`; draws again only when it is another. */
export function useGraphPart<T>(part: (graph: Graph) => T): T {
  const { source } = useRoom();
  const get = () => part(source.graph());
  return useSyncExternalStore(source.subscribe, get, get);
}

/** Returns the state of the connection and the number of edits that are not stored yet. */
export function useLink(): RoomLink {
  const { room, onLink } = useRoom();
  return useSyncExternalStore(onLink, room.link);
}

/** The link, as old as the calm graph where only its place in the log is another; without what is kept here. */
export function useThrottledLink(): Omit<RoomLink, "kept"> {
  const { room, throttled: calm } = useRoom();
  const last = useRef<Omit<RoomLink, "kept">>(NO_LINK);
  return useSyncExternalStore(calm.onLink, () => {
    const { kept, ...now } = room.link();
    if (!isEqual(now, last.current)) last.current = now;
    return last.current;
  });
}

const NO_LINK: RoomLink = { state: "connecting", unsaved: 0, seq: 0 };

/** Return a part of the link; draws again only when it is another. */
export function useLinkPart<T>(part: (link: RoomLink) => T): T {
  const { room, onLink } = useRoom();
  return useSyncExternalStore(onLink, () => part(room.link()));
}

/** The others in the room. */
export function usePeople(): readonly Participant[] {
  const { presence } = useRoom();
  return useSyncExternalStore(presence.onPeople, presence.people);
}

/**
 * Returns a function from a person to a colour that no other person here has. It is another function only when
 * somebody came or went, however much cursors move. `ids` are people who may have left long ago.
 */
export function usePersonColors(ids: readonly string[] = NO_IDS): (id: string) => string {
  const { presence } = useRoom();
  const last = useRef<readonly Colored[]>([]);
  const here = useSyncExternalStore(presence.onPeople, () => {
    const now = presence.people().map(({ id, color }) => ({ id, color }));
    if (!isEqual(now, last.current)) last.current = now;
    return last.current;
  });
  const known = useKnownPeople(ids);
  return useMemo(() => colorsOf(here, known), [here, known]);
}

/**
 * Refreshes the colours of people when the room is back: a restarted server gives colours in the order in which
 * people come.
 */
export function useColorsAfterReturn(): void {
  const isLive = useLinkPart(({ state }) => state === "live");
  const wasLive = useRef(false);
  const client = useQueryClient();
  useEffect(() => {
    if (isLive && wasLive.current) void client.invalidateQueries({ queryKey: ["people"] });
    wasLive.current ||= isLive;
  }, [isLive, client]);
}

const NO_IDS: readonly string[] = [];

/** Another person in the room, with what lists show of them. */
export type PersonHere = Pick<Participant, "id" | "name" | "color">;

type Chosen = readonly (readonly [key: string, person: PersonHere])[];

/** Returns for each key the people who have it selected; another map only when a selection changes. */
export function useSelectedByOthers(): ReadonlyMap<string, readonly PersonHere[]> {
  const { presence } = useRoom();
  const last = useRef<Chosen>([]);
  const chosen = useSyncExternalStore(presence.onPeople, () => {
    const now = presence
      .people()
      .flatMap(({ id, name, color, presence: { selection } }) =>
        selection.map((key) => [key, { id, name, color }] as const),
      );
    if (!isEqual(now, last.current)) last.current = now;
    return last.current;
  });
  return useMemo(() => {
    const found = new Map<string, PersonHere[]>();
    for (const [key, person] of chosen) {
      const known = found.get(key);
      if (known === undefined) found.set(key, [person]);
      else if (known.every(({ id }) => id !== person.id)) known.push(person);
    }
    return found;
  }, [chosen]);
}

/** A person who is at a field, without what changes while they are there. */
export type FieldEditor = Pick<Participant, "client" | "id" | "name">;

const NO_EDITORS: readonly FieldEditor[] = [];

/** The others who edit one field, `<key>|<field>`; draws again only when somebody comes or goes. */
export function useEditors(field: string): readonly FieldEditor[] {
  const { presence } = useRoom();
  const last = useRef(NO_EDITORS);
  return useSyncExternalStore(presence.onPeople, () => {
    const found = presence
      .people()
      .filter((person) => person.presence.editing === field)
      .map(({ client, id, name }) => ({ client, id, name }));
    if (!isEqual(found, last.current)) last.current = found;
    return last.current;
  });
}

/** Return whom this page follows, and a function that begins and ends that. */
export function useFollowing() {
  const { following } = useRoom();
  const whom = useSyncExternalStore(following.onChange, following.whom);
  const follow = useCallback((client: number | null) => following.follow(client), [following]);
  return { whom, follow };
}

/** Returns the decision about edits that wait on another history; null when there is none. */
export function useStrandedEdits(): StrandedEditsChoice | null {
  const { connection, connectionState } = useRoomContext();
  const [stranded] = connectionState.stranded;
  return useMemo(() => {
    if (stranded === undefined) return null;
    return {
      stranded,
      apply: (chosen) => connection.apply(stranded, chosen),
      drop: () => connection.drop(stranded),
    };
  }, [connection, stranded]);
}

/** Returns the choices between values that this person and others set, until the person has seen them. */
export function useChangedTwice(): readonly ChangedTwice[] {
  const { changedTwice } = useRoom().room;
  return useSyncExternalStore(changedTwice.onChange, changedTwice.now);
}

/** Returns the notice of this room until the person has read it. */
export function useNotice(): { readonly notice: ConnectionNotice; dismiss(): void } | null {
  const { connection, connectionState } = useRoomContext();
  const { notice } = connectionState;
  return useMemo(
    () => notice && { notice, dismiss: () => connection.dismiss() },
    [connection, notice],
  );
}

const NOBODY: readonly OtherPerson[] = [];

/** The others whose edits of this graph wait on this device until they sign in again. */
export interface OthersWaiting {
  readonly others: readonly OtherPerson[];
  /** Returns the changes of another person, to save them as a file; they are never sent. */
  read(id: string): Promise<readonly StrandedEdits[]>;
  /** Deletes another person's edits for good. */
  forget(id: string): Promise<void>;
}

export function useOthersWaiting(): OthersWaiting {
  const { keep } = useRoomContext();
  const [others, setOthers] = useState(NOBODY);
  const device = keep && (keep.device ?? browserStore());
  useEffect(() => {
    if (keep === undefined || device === undefined) return;
    let gone = false;
    device.others(keep).then(
      (found) => !gone && setOthers(found),
      () => !gone && setOthers(NOBODY), // a device that keeps nothing keeps nobody's
    );
    return () => {
      gone = true;
    };
  }, [keep, device]);
  return useMemo(() => {
    const waiting = async (id: string) => {
      if (keep === undefined || device === undefined) return [];
      const all = await device.read({ graph: keep.graph, person: { id, name: "" } });
      return all.filter((kept) => kept.waiting.length > 0);
    };
    return {
      others,
      read: async (id) => (await waiting(id)).map(strandedEditsOf),
      forget: async (id) => {
        if (keep === undefined || device === undefined) return;
        const owner = { graph: keep.graph, person: { id, name: "" } };
        for (const kept of await waiting(id)) {
          await device.forget(owner, kept.epoch, kept.waiting.map(idOf));
        }
        setOthers((now) => now.filter((other) => other.id !== id));
      },
    };
  }, [keep, device, others]);
}

/** Returns whether undo and redo have a step to take. */
export function useUndo(): { readonly canUndo: boolean; readonly canRedo: boolean } {
  const { undo } = useRoom();
  const [can, setCan] = useState({ canUndo: false, canRedo: false });
  useEffect(() => {
    const look = () => {
      const now = { canUndo: undo.canUndo(), canRedo: undo.canRedo() };
      setCan((before) => (isEqual(before, now) ? before : now));
    };
    const events = ["stack-item-added", "stack-item-popped"] as const;
    for (const event of events) undo.on(event, look);
    look();
    return () => {
      for (const event of events) undo.off(event, look);
    };
  }, [undo]);
  return can;
}
