/** The person whose view this page follows, until either side ends it. */

import { isSameView, type PresenceSource, type SharedView } from "./presence";

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

  /** The page that is followed; null when none is. */
  readonly whom = (): number | null => this.client;

  /** What of the canvas they see; the same object until that changes. Null when they do not say. */
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
