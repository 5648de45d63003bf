/**
 * A WebSocket that reconnects: dials, waits longer each time, notices when the other end is dead.
 *
 * Knows nothing of documents. Whether to dial at all is asked before (`admit`); when to stop is
 * said by close codes.
 */

import { tick } from "../clock/server-clock";
import * as messages from "./messages";
import { type AdmissionCheck, Away, type RefusalReason, type Socket } from "./room";

/** The server says something at least every 15 s; a socket this silent is dead. */
const SILENCE_MS = 30_000;
const OPENING_MS = 10_000;
const FIRST_RETRY_MS = 300;
const LAST_RETRY_MS = 10_000;
/** A hidden page without unsaved edits waits this long before it tries again. */
const HIDDEN_RETRY_MS = 60_000;
/** An answer to a question that any living server answers at once. */
const PROBE_MS = 5_000;
const OPEN = 1;
/** The other end is dead, or speaks nonsense. */
const BROKEN = 1006;

export interface ReconnectingSocketOptions {
  /** Returns the address for this attempt. */
  readonly url: () => string;
  readonly open: (url: string) => Socket;
  /** Returns a random number between 0 and 1, for the spread of reconnects. */
  readonly random: () => number;
  readonly admit: AdmissionCheck | null;
}

/** The owner of the socket: it gives what is sent, and takes what comes. */
export interface SocketHandler {
  /** Returns true if edits wait to be sent; then a hidden page does not wait longer. */
  hasWork(): boolean;
  /** A question that any living server answers at once. */
  probe(): Uint8Array<ArrayBuffer>;
  onOpen(): void;
  /** Takes a message. Throws for one that cannot be read; the socket is then opened anew. */
  onMessage(data: Uint8Array): void;
  /** The socket is gone, whatever comes next. */
  onDrop(): void;
  /** The socket was closed, and will be opened again without help. `said`: more words about it. */
  onAway(why: RefusalReason | undefined, said?: string): void;
  /** The server refused the page, and no attempt follows. */
  onRefused(why: RefusalReason): void;
}

type Phase = "connecting" | "live" | "away" | "refused" | "closed";

export class ReconnectingSocket {
  private readonly options: ReconnectingSocketOptions;
  private readonly speaker: SocketHandler;
  private phase: Phase = "connecting";
  private socket: Socket | null = null;
  private heardAt = 0;
  private probedAt: number | null = null;
  private turn = 0;
  private attempts = 0;
  /** Sockets in a row that did not open although admission was granted. */
  private unopened = 0;
  private retry: ReturnType<typeof setTimeout> | undefined;
  private readonly watch: ReturnType<typeof setInterval>;

  constructor(options: ReconnectingSocketOptions, speaker: SocketHandler) {
    this.options = options;
    this.speaker = speaker;
    globalThis.addEventListener?.("online", this.onWake);
    globalThis.addEventListener?.("offline", this.onWake);
    globalThis.document?.addEventListener("visibilitychange", this.onVisibility);
    this.watch = setInterval(this.onWatch, 1_000);
  }

  get isOpen(): boolean {
    return this.socket?.readyState === OPEN;
  }

  send(frame: Uint8Array<ArrayBuffer>): void {
    if (this.socket?.readyState === OPEN) this.socket.send(frame);
  }

  dial(): void {
    clearTimeout(this.retry);
    this.turn += 1;
    if (this.options.admit === null) this.enter();
    else void this.knock(this.options.admit, this.turn);
  }

  /** At once, whatever was before. */
  redial(): void {
    this.attempts = 0;
    this.drop();
    if (this.phase !== "away") this.phase = "connecting";
    this.dial();
  }

  /** The other end is who it should be, and answers: the next failure is a new one. */
  arrived(): void {
    this.attempts = 0;
    this.probedAt = null;
    this.phase = "live";
  }

  /** Ends it for a reason of our own, and does not try again. */
  refuse(why: RefusalReason): void {
    this.drop();
    this.stop(why);
  }

  close(): void {
    this.phase = "closed";
    clearInterval(this.watch);
    globalThis.removeEventListener?.("online", this.onWake);
    globalThis.removeEventListener?.("offline", this.onWake);
    globalThis.document?.removeEventListener("visibilitychange", this.onVisibility);
    this.drop();
  }

  private async knock(admit: AdmissionCheck, turn: number): Promise<void> {
    const why = await admit(this.attempts > 0, this.speaker.hasWork()).catch((error: unknown) =>
      error instanceof Away ? error : ("nobody" as const),
    );
    if (turn !== this.turn || this.phase === "closed") return;
    if (why === null) this.enter();
    else if (why === "nobody") {
      this.unopened = 0;
      this.stayAway(undefined);
    } else if (why instanceof Away) {
      this.unopened = 0;
      this.stayAway(why.why, why.message);
    } else this.stop(why);
  }

  private enter(): void {
    const socket = this.options.open(this.options.url());
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heardAt = tick();
    this.probedAt = null;
    let opened = false;
    socket.onopen = () => {
      if (socket !== this.socket) return;
      this.heardAt = tick();
      this.unopened = 0;
      opened = true;
      this.speaker.onOpen();
    };
    socket.onmessage = ({ data }) => this.onMessage(socket, data);
    socket.onclose = ({ code, reason }) => {
      if (!opened && this.options.admit !== null) this.unopened += 1;
      this.onClose(socket, code, reason);
    };
    socket.onerror = () => undefined; // a close event follows
  }

  private onMessage(socket: Socket, data: unknown): void {
    if (socket !== this.socket) return;
    this.heardAt = tick();
    // This message may have been sent before the question: only the answer ends the doubt.
    if (this.probedAt !== null) this.probedAt = this.heardAt;
    if (!(data instanceof ArrayBuffer)) return;
    try {
      this.speaker.onMessage(new Uint8Array(data));
    } catch (error) {
      console.error("The room sent something that cannot be read", error);
      this.onClose(socket, BROKEN);
    }
  }

  private onClose(socket: Socket, code: number, reason = ""): void {
    if (socket !== this.socket) return;
    this.drop();
    const refused = messages.refusalOf(code, reason);
    if (refused !== undefined) this.stop(refused);
    else
      this.stayAway(
        messages.RETRIED_CLOSES.get(code) ?? (this.unopened > 1 ? "no-socket" : undefined),
      );
  }

  private stop(why: RefusalReason): void {
    this.phase = "refused";
    this.speaker.onRefused(why);
  }

  private stayAway(why: RefusalReason | undefined, said?: string): void {
    this.phase = "away";
    const hasNetwork = globalThis.navigator?.onLine !== false;
    this.speaker.onAway(why ?? (hasNetwork ? undefined : "no-network"), said);
    const hidden = globalThis.document?.visibilityState === "hidden";
    const soon = Math.min(LAST_RETRY_MS, FIRST_RETRY_MS * 2 ** this.attempts);
    const longest = hidden && !this.speaker.hasWork() ? HIDDEN_RETRY_MS : soon;
    this.attempts += 1;
    clearTimeout(this.retry);
    this.retry = setTimeout(() => this.dial(), longest * (0.5 + this.options.random() / 2));
  }

  private drop(): void {
    clearTimeout(this.retry);
    this.turn += 1;
    const socket = this.socket;
    this.socket = null;
    if (socket !== null) {
      socket.onopen = socket.onmessage = socket.onclose = null;
      socket.close();
    }
    this.speaker.onDrop();
  }

  /** The network or the page changed: try at once, or see whether the socket still lives. */
  private readonly onWake = (): void => {
    if (this.phase === "away") {
      this.redial();
    } else if (this.phase === "live") {
      this.probedAt = tick();
      this.send(this.speaker.probe());
    }
  };

  private readonly onVisibility = (): void => {
    if (globalThis.document.visibilityState === "visible") this.onWake();
  };

  private readonly onWatch = (): void => {
    if (this.socket === null) return;
    const limit = this.socket.readyState === OPEN ? SILENCE_MS : OPENING_MS;
    const now = tick();
    const mute = this.probedAt !== null && now - this.probedAt > PROBE_MS;
    if (mute || now - this.heardAt > limit) this.onClose(this.socket, BROKEN);
  };
}
