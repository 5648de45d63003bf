/**
 * Presence: who else is in the room and what they do: cursors, selections, drags, the field they edit.
 *
 * Travels by awareness and is stored nowhere. The server stamps `user` on what a page sends, so
 * names and colours here are the server's word; everything else is another page's word and is taken
 * only as far as it fits.
 */

import type { Awareness } from "y-protocols/awareness";
import { tick } from "../../clock/server-clock";
import type { Key, Position } from "../../graph/model";
import { isEqual } from "../../graph/values";
import { immediately, type Schedule } from "./frame-scheduler";

/** The awareness state that this page sends to the others. */
interface Presence {
  /** The pointer, in the coordinates of the canvas. */
  readonly cursor?: Position;
  readonly selection: readonly Key[];
  /** The field being edited, as `<key>|<field>`. */
  readonly editing?: string;
  /** The part of the canvas that this page shows: the place of its top left corner, and its size. */
  readonly view?: SharedView;
  /** The things being dragged, and the distance so far. */
  readonly drag?: { readonly ids: readonly Key[]; readonly dx: number; readonly dy: number };
}

export interface SharedView {
  readonly x: number;
  readonly y: number;
  readonly zoom: number;
  /** The size of the canvas on their screen, in px. */
  readonly width?: number;
  readonly height?: number;
}

function isSameView(a: SharedView | null, b: SharedView | null): boolean {
  return a === b || (a !== null && b !== null && isEqual(a, b));
}

/** One other page. A person with two windows is here twice, with the same `id`. */
export interface Participant {
  readonly client: number;
  readonly id: string;
  readonly name: string;
  readonly color: string;
  readonly presence: Presence;
}

type PresenceChange = { readonly [F in keyof Presence]?: Presence[F] | undefined };

export interface PresenceSource {
  /**
   * Returns the others, by name: the same list until a part of it changes, and the same objects for unchanged
   * people.
   */
  people(): readonly Participant[];
  onPeople(listener: () => void): () => void;
  /** Tells the others, at most 20 times a second; `undefined` takes a field back. */
  tell(change: PresenceChange): void;
  close(): void;
}

const INTERVAL_MS = 50;
const NOTHING: Presence = { selection: [] };

/** Shares what this page does with the others, and follows them. `soon` calls back for changes of the others. */
export function presenceOf(awareness: Awareness, soon: Schedule = immediately): PresenceSource {
  let mine: Presence = NOTHING;
  let sentAt = Number.NEGATIVE_INFINITY;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let people: readonly Participant[] = peopleOf(awareness, []);
  const listeners = new Set<() => void>();

  const send = () => {
    timer = undefined;
    sentAt = tick();
    awareness.setLocalState({ ...mine });
  };
  const tell = () => {
    for (const listener of [...listeners]) listener();
  };
  const onChange = () => {
    const fresh = peopleOf(awareness, people);
    if (fresh === people) return;
    people = fresh;
    soon(tell);
  };
  awareness.on("change", onChange);
  return {
    people: () => people,
    onPeople(listener) {
      listeners.add(listener);
      return () => listeners.delete(listener);
    },
    tell(change) {
      const next = merge(mine, change);
      if (isEqual(mine, next)) return;
      mine = next;
      if (timer !== undefined) return;
      const wait = sentAt + INTERVAL_MS - tick();
      if (wait <= 0) send();
      else timer = setTimeout(send, wait);
    },
    close() {
      clearTimeout(timer);
      awareness.off("change", onChange);
      listeners.clear();
    },
  };
}

function merge(old: Presence, change: PresenceChange): Presence {
  const entries = Object.entries({ ...old, ...change }).filter(([, value]) => value !== undefined);
  return { ...NOTHING, ...(Object.fromEntries(entries) as Partial<Presence>) };
}

function peopleOf(awareness: Awareness, before: readonly Participant[]): readonly Participant[] {
  const known = new Map(before.map((person) => [person.client, person]));
  const people: Participant[] = [];
  for (const [client, state] of awareness.getStates()) {
    if (client === awareness.clientID) continue;
    const fresh = personOf(client, state);
    if (fresh === null) continue;
    const old = known.get(client);
    people.push(old !== undefined && isEqual(old, fresh) ? old : fresh);
  }
  people.sort((a, b) => a.name.localeCompare(b.name) || a.client - b.client);
  const unchanged = people.length === before.length && people.every((p, i) => p === before[i]);
  return unchanged ? before : people;
}

function personOf(client: number, state: Readonly<Record<string, unknown>>): Participant | null {
  const { id, name, color } = record(state.user);
  if (typeof id !== "string" || typeof name !== "string") return null;
  const cursor = pair(state.cursor);
  const drag = dragOf(state.drag);
  const view = viewOf(state.view);
  return {
    client,
    id,
    name,
    color: typeof color === "string" ? color : "",
    presence: {
      selection: texts(state.selection),
      ...(cursor && { cursor }),
      ...(typeof state.editing === "string" && { editing: state.editing }),
      ...(view && { view }),
      ...(drag && { drag }),
    },
  };
}

function dragOf(value: unknown): Presence["drag"] | null {
  const { ids, dx, dy } = record(value);
  const way = pair([dx, dy]);
  return way && { ids: texts(ids), dx: way[0], dy: way[1] };
}

function viewOf(value: unknown): SharedView | null {
  const { x, y, zoom, width, height } = record(value);
  const place = pair([x, y]);
  if (place === null || typeof zoom !== "number" || !(zoom > 0 && zoom < 1e3)) return null;
  const size = pair([width, height]);
  const sized = size !== null && size[0] > 0 && size[1] > 0;
  return {
    x: place[0],
    y: place[1],
    zoom,
    ...(sized && { width: size[0], height: size[1] }),
  };
}

const record = (value: unknown): Readonly<Record<string, unknown>> =>
  typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};

const texts = (value: unknown): string[] =>
  Array.isArray(value) ? value.filter((item) => typeof item === "string") : [];

const pair = (value: unknown): Position | null =>
  Array.isArray(value) && Number.isFinite(value[0]) && Number.isFinite(value[1])
    ? [value[0], value[1]]
    : null;

export class FollowedPerson {
  private readonly presence: PresenceSource;
  private readonly listeners = new Set<() => void>();
  private readonly unhear: () => void;
  private client: number | null = null;
  private place: SharedView | null = null;

  constructor(presence: PresenceSource) {
    this.presence = presence;
    this.unhear = presence.onPeople(() => this.look());
  }

  /** Returns the client id of the followed page; null when none is followed. */
  readonly whom = (): number | null => this.client;

  /**
   * Returns the part of the canvas that the followed person sees: the same object until it changes, null while
   * unknown.
   */
  readonly view = (): SharedView | null => this.place;

  readonly onChange = (listener: () => void): (() => void) => {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  };

  follow(client: number | null): void {
    if (client === this.client) return;
    this.client = client;
    this.place = null;
    this.look();
    this.tell();
  }

  close(): void {
    this.unhear();
    this.listeners.clear();
  }

  private look(): void {
    if (this.client === null) return;
    const leader = this.presence.people().find(({ client }) => client === this.client);
    if (leader === undefined) {
      this.follow(null); // they have left
      return;
    }
    const next = leader.presence.view ?? null;
    if (isSameView(next, this.place)) return;
    this.place = next;
    this.tell();
  }

  private tell(): void {
    for (const listener of [...this.listeners]) listener();
  }
}
