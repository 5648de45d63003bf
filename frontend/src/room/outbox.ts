/**
 * Which of a person's edits are durable.
 *
 * The room acknowledges by counting this socket's document messages (sync step 2 and updates), so
 * each waiting edit remembers the message that carried it. A new socket counts from nothing: what
 * was not acknowledged on the old one goes again, with the first step 2.
 */

const NOT_SENT = Number.POSITIVE_INFINITY;

export class Outbox {
  /** For each edit that waits: the number of the message that carried it. In order. */
  private waiting: number[] = [];
  private sent = 0;
  private answeredSync = false;

  /** Edits that are not durable. */
  get unsaved(): number {
    return this.waiting.length;
  }

  /** Whether the room has been given what it lacked, so that single updates may follow. */
  get answered(): boolean {
    return this.answeredSync;
  }

  /** A new socket. */
  fresh(): void {
    this.sent = 0;
    this.answeredSync = false;
    this.waiting = this.waiting.map(() => NOT_SENT);
  }

  /** The person changed something. */
  edited(): void {
    this.waiting.push(NOT_SENT);
  }

  /** A message went out that carries everything so far. */
  sentAll(): void {
    this.answeredSync = true;
    this.sent += 1;
    this.waiting = this.waiting.map((message) => (message === NOT_SENT ? this.sent : message));
  }

  /** The first `count` messages of this socket are durable. */
  durable(count: number): void {
    this.waiting = this.waiting.filter((message) => message > count);
  }
}
