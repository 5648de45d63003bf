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
import { same } from "../graph/equal";
import { EMPTY_GRAPH, type Graph } from "../graph/model";
import { type Notice, type Stay, Visit } from "./graph-connection";
import { browser, type OtherPerson } from "./indexed-db";
import type { OpenRoom } from "./open-room";
import type { Person } from "./presence/presence";
import { type Stranded, strandedOf } from "./replaced-history";
import type { Keep, Link } from "./room-connection";

export type { OpenRoom } from "./open-room";

/** What there is to decide about edits that wait on a history which the server has left. */
export interface Choice {
  readonly stranded: Stranded;
  /** Makes these of the changes in the graph as it is now, and lets go of the rest once stored. */
  apply(chosen: Stranded["difference"]): Promise<number>;
  /** Lets go of the edits. */
  drop(): Promise<void>;
}

interface Held {
  readonly visit: Visit;
  readonly stay: Stay;
  readonly keep: Keep | undefined;
}

const RoomContext = createContext<Held | null>(null);

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
  const keep = useSteady(given);
  const [held, setHeld] = useState<Held | null>(null);
  useEffect(() => {
    const visit = new Visit({ url, ...(keep && { keep }) });
    const show = () => setHeld({ visit, stay: visit.now(), keep });
    const stop = visit.onChange(show);
    show();
    return () => {
      stop();
      visit.leave();
      setHeld(null);
    };
  }, [url, keep]);
  useBeforeLeaving(held);
  return held === null ? fallback : <RoomContext value={held}>{children}</RoomContext>;
}

/** Asks before the page is closed, when something would be lost by that. */
function useBeforeLeaving(held: Held | null): void {
  const open = held?.stay.open;
  useEffect(() => {
    const onLeave = (event: BeforeUnloadEvent) => {
      const link = open?.room.link();
      if (link && link.unsaved > 0 && !link.kept) event.preventDefault();
    };
    window.addEventListener("beforeunload", onLeave);
    return () => window.removeEventListener("beforeunload", onLeave);
  }, [open]);
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

function useHeld(): Held {
  const held = useContext(RoomContext);
  if (held === null) throw new Error("useRoom needs a RoomProvider around it");
  return held;
}

/** The room around this component. */
export function useRoom(): OpenRoom {
  return useHeld().stay.open;
}

/** The name of the person at this page; empty in a room that keeps nothing. */
export function useMyName(): string {
  return useHeld().keep?.person.name ?? "";
}

/** The graph now. Actions and relations that did not change are the same objects as before. */
export function useGraph(): Graph {
  const { source } = useRoom();
  return useSyncExternalStore(source.subscribe, source.graph, () => EMPTY_GRAPH);
}

/** The graph for what stands beside the canvas: own edits at once, those of others some times a second. */
export function useCalmGraph(): Graph {
  const { source, calm } = useRoom();
  return useSyncExternalStore(calm.onGraph, source.graph, () => EMPTY_GRAPH);
}

/** One thing of the graph, say `(graph) => graph.name`; draws again only when it is another. */
export function useGraphPart<T>(part: (graph: Graph) => T): T {
  const { source } = useRoom();
  const get = () => part(source.graph());
  return useSyncExternalStore(source.subscribe, get, get);
}

/** How the page stands with the server, and how many edits are not stored yet. */
export function useLink(): Link {
  const { room, onLink } = useRoom();
  return useSyncExternalStore(onLink, room.link);
}

/** The link, as old as the calm graph where only its place in the log is another. */
export function useCalmLink(): Link {
  const { room, calm } = useRoom();
  return useSyncExternalStore(calm.onLink, room.link);
}

/** One thing of the link; draws again only when it is another. */
export function useLinkPart<T>(part: (link: Link) => T): T {
  const { room, onLink } = useRoom();
  return useSyncExternalStore(onLink, () => part(room.link()));
}

/** The others in the room. */
export function usePeople(): readonly Person[] {
  const { presence } = useRoom();
  return useSyncExternalStore(presence.onPeople, presence.people);
}

/** Somebody at a field: who they are, and nothing that changes while they are there. */
export type Editing = Pick<Person, "client" | "id" | "name">;

const NO_EDITORS: readonly Editing[] = [];

/** The others who edit one field, `<key>|<field>`; draws again only when somebody comes or goes. */
export function useEditors(field: string): readonly Editing[] {
  const { presence } = useRoom();
  const last = useRef(NO_EDITORS);
  return useSyncExternalStore(presence.onPeople, () => {
    const found = presence
      .people()
      .filter((person) => person.presence.editing === field)
      .map(({ client, id, name }) => ({ client, id, name }));
    if (!same(found, last.current)) last.current = found;
    return last.current;
  });
}

/** Whom this page follows, and how to begin and end that. */
export function useFollowing() {
  const { following } = useRoom();
  const whom = useSyncExternalStore(following.onChange, following.whom);
  const follow = useCallback((client: number | null) => following.follow(client), [following]);
  return { whom, follow };
}

/** What there is to decide about edits that wait on another history; null when nothing is. */
export function useChoice(): Choice | null {
  const { visit, stay } = useHeld();
  const [stranded] = stay.stranded;
  return useMemo(() => {
    if (stranded === undefined) return null;
    return {
      stranded,
      apply: (chosen) => visit.apply(stranded, chosen),
      drop: () => visit.drop(stranded),
    };
  }, [visit, stranded]);
}

/** What may be said softly about this room, until it was read. */
export function useNotice(): { readonly notice: Notice; dismiss(): void } | null {
  const { visit, stay } = useHeld();
  const { notice } = stay;
  return useMemo(() => notice && { notice, dismiss: () => visit.dismiss() }, [visit, notice]);
}

const NOBODY: readonly OtherPerson[] = [];

/** The others whose edits of this graph wait on this device until they sign in again. */
export interface OthersWaiting {
  readonly others: readonly OtherPerson[];
  /** What somebody changed, to save it as a file; never to send it. */
  read(id: string): Promise<readonly Stranded[]>;
  /** Lets go of somebody's edits for good. */
  forget(id: string): Promise<void>;
}

export function useOthersWaiting(): OthersWaiting {
  const { keep } = useHeld();
  const [others, setOthers] = useState(NOBODY);
  const device = keep && (keep.device ?? browser());
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
      read: async (id) => (await waiting(id)).map(strandedOf),
      forget: async (id) => {
        if (keep === undefined || device === undefined) return;
        const shelf = { graph: keep.graph, person: { id, name: "" } };
        for (const { epoch } of await waiting(id)) await device.forget(shelf, epoch);
        setOthers((now) => now.filter((other) => other.id !== id));
      },
    };
  }, [keep, device, others]);
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
