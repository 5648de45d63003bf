/**
 * The one clock of the page: the server's. A browser's own clock may be hours off, and somebody may set
 * it while the page is open, so nothing that the server tells is compared with it.
 *
 * Durations within the page are differences of `tick()`, which nobody sets. What the server tells is
 * compared with `serverNow()`: its time at tick 0, measured, and the tick that it is now.
 */

/** Milliseconds of a clock that nobody sets; of no day. */
export function tick(): number {
  return performance.now();
}

const KEPT = 10; // stamps: a clock of the server that is set anew is followed within so many messages

/** Measures the offset of the server's clock to `tick()`, by stamps in what the server sends. */
export class ServerOffset {
  /** By each of the newest exact stamps: the true offset is this and the time under way. */
  #least: number[] = [];
  #now: number;

  /** `assumed`: until the server has said anything, the browser's own clock has to do. */
  constructor(assumed: number) {
    this.#now = assumed;
  }

  /** The server's time at tick 0, ms since 1970. */
  now(): number {
    return this.#now;
  }

  /** Whether the server has said its time exactly. */
  get isMeasured(): boolean {
    return this.#least.length > 0;
  }

  /** Take in a message that was stamped (ms since 1970) as it was sent, and came at this tick. */
  hear(stamp: number, came: number): void {
    if (!Number.isFinite(stamp)) return;
    this.#least = [...this.#least.slice(1 - KEPT), stamp - came];
    this.#now = Math.max(...this.#least);
  }

  /**
   * Take in an answer with a stamp of whole seconds, as in its header `Date`, to what was asked at one
   * tick and answered until another: the stamp was right, to two seconds, at some moment between them.
   */
  hearRoundTrip(stamp: number, asked: number, came: number): void {
    if (!Number.isFinite(stamp) || this.isMeasured) return; // by far not as exact
    const [least, most] = [stamp - came, stamp + 2_000 - asked];
    if (this.#now < least || this.#now > most) this.#now = (least + most) / 2;
  }
}

/** The clock by which the page goes: that of the editor and of the runner beside it. */
export const pageClock = new ServerOffset(Date.now() - tick());

/** Take in the header `Date` of an answer to what was asked at this tick. */
export function hearAnswer(date: string | null, asked: number): void {
  if (date !== null) pageClock.hearRoundTrip(Date.parse(date), asked, tick());
}

/** The server's time of a tick, ms since 1970, as far as it is known now. */
export function serverTimeOf(at: number): number {
  return at + pageClock.now();
}

/** The server's time, ms since 1970. */
export function serverNow(): number {
  return serverTimeOf(tick());
}

/** This device's own time, ms since 1970: for what stays on this device and is compared with nothing. */
export function deviceNow(): number {
  return Date.now();
}
