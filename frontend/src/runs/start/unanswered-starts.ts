/** Starts that were sent and that nobody has answered: kept with the tab, also when it loads anew. */

export interface SentStart {
  /** Its `request_id`: by this the runner knows what it has become. */
  request: string;
  graph: string;
  /** What was sent, in words: "v3 of patrol". */
  what: string;
  engines: readonly string[];
  /** When it was sent, ms. */
  at: number;
}

const KEY = "aa.starts";
const MOST = 20;

type Storing = Pick<Storage, "getItem" | "setItem">;

/** Usable without React: `subscribe` and `list` fit `useSyncExternalStore`. */
export class UnansweredStarts {
  readonly #storage: Storing | null;
  readonly #listeners = new Set<() => void>();
  #sent: readonly SentStart[];
  /** Requests whose answer this page still waits for. */
  readonly #awaited = new Set<string>();
  #unsure: readonly SentStart[];

  /** What is stored was sent by a page that is gone: its answer comes no more. */
  constructor(storage: Storing | null) {
    this.#storage = storage;
    this.#sent = stored(storage);
    this.#unsure = this.#sent;
  }

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };

  /** Those that will not be answered any more. */
  list = (): readonly SentStart[] => this.#unsure;

  /** It is about to leave; from here on only an answer says what became of it. */
  sends(start: SentStart): void {
    this.#awaited.add(start.request);
    this.#put([...this.#sent, start].slice(-MOST));
  }

  /** There will be no answer. */
  doubt(request: string): void {
    this.#awaited.delete(request);
    this.#put(this.#sent);
  }

  /** It was answered, or somebody has seen what became of it. */
  settle(request: string): void {
    this.#awaited.delete(request);
    this.#put(this.#sent.filter((each) => each.request !== request));
  }

  #put(sent: readonly SentStart[]): void {
    this.#sent = sent;
    this.#unsure = sent.filter(({ request }) => !this.#awaited.has(request));
    try {
      this.#storage?.setItem(KEY, JSON.stringify(sent));
    } catch {
      // A tab that stores nothing still knows it until it is loaded anew.
    }
    for (const listener of this.#listeners) listener();
  }
}

function stored(storage: Storing | null): readonly SentStart[] {
  try {
    const found: unknown = JSON.parse(storage?.getItem(KEY) ?? "[]");
    return Array.isArray(found) ? found.filter(isSent) : [];
  } catch {
    return [];
  }
}

function isSent(value: unknown): value is SentStart {
  if (typeof value !== "object" || value === null) return false;
  const { request, what, engines } = value as Partial<SentStart>;
  return typeof request === "string" && typeof what === "string" && Array.isArray(engines);
}

function storage(): Storing | null {
  try {
    return window.sessionStorage;
  } catch {
    return null; // a browser may forbid it
  }
}

export const unansweredStarts = new UnansweredStarts(storage());
