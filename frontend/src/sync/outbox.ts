/**
 * The person's edits that the server has not stored yet.
 *
 * The room acknowledges by counting this socket's document messages (sync step 2 and updates), so
 * each waiting edit remembers the message that carried it. A new socket counts from nothing: what
 * was not acknowledged on the old one goes again, with the first step 2.
 */

import type { UnsavedEdit } from "./indexed-db";

const NOT_SENT = Number.POSITIVE_INFINITY;

export class Outbox {
  /** In the order in which they were made. */
  private waiting: { readonly edit: UnsavedEdit; message: number }[] = [];
  private sent = 0;
  private answeredSync = false;

  /** The number of edits that are not durable. */
  get unsaved(): number {
    return this.waiting.length;
  }

  /** The edits that are not durable. */
  get edits(): readonly UnsavedEdit[] {
    return this.waiting.map(({ edit }) => edit);
  }

  /** The edits that were not sent on this socket yet. */
  get unsent(): readonly UnsavedEdit[] {
    return this.waiting.filter(({ message }) => message === NOT_SENT).map(({ edit }) => edit);
  }

  /** True once step 2 was sent on this socket; single updates may follow then. */
  get answered(): boolean {
    return this.answeredSync;
  }

  /** Starts counting anew for a new socket: nothing was sent on it. */
  fresh(): void {
    this.sent = 0;
    this.answeredSync = false;
    for (const each of this.waiting) each.message = NOT_SENT;
  }

  /** Adds an edit that the person made. */
  edited(edit: UnsavedEdit): void {
    this.waiting.push({ edit, message: NOT_SENT });
  }

  /** Counts a message that carries a part of an edit; the last part follows. */
  sentPart(): void {
    this.sent += 1;
  }

  /** Counts a message that carries all edits so far, or none. */
  sentAll(): void {
    this.sentSome(this.waiting.length);
  }

  /** A message went out that carries the first `count` edits and what went before. */
  sentSome(count: number): void {
    this.answeredSync = true;
    this.sent += 1;
    for (const each of this.waiting.slice(0, count)) {
      if (each.message === NOT_SENT) each.message = this.sent;
    }
  }

  /** Removes and returns the edits that are durable since the server acknowledged the first `count` messages. */
  durable(count: number): UnsavedEdit[] {
    const done = this.waiting.filter(({ message }) => message <= count);
    if (done.length > 0) this.waiting = this.waiting.filter(({ message }) => message > count);
    return done.map(({ edit }) => edit);
  }

  /** Removes these edits without storing them. */
  drop(edits: readonly UnsavedEdit[]): void {
    this.waiting = this.waiting.filter(({ edit }) => !edits.includes(edit));
  }

  /** Removes all edits, stored or not. */
  clear(): void {
    this.waiting = [];
  }
}
