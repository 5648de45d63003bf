/**
 * Request ids of presses whose answers got lost, by what was pressed. They live as long as the tab: a press that is
 * made again after the page was loaded anew counts once with the first.
 */
type Storing = Pick<Storage, "getItem" | "setItem">;

const KEY = "aa.presses";
const MOST = 50;
const LONGEST = 20_000; // characters of what is kept beyond this page

class LostPresses {
  readonly #storage: Storing | null;
  readonly #requests: Map<string, string>;

  constructor(storage: Storing | null) {
    this.#storage = storage;
    this.#requests = new Map(stored(storage));
  }

  /** Return the request id of a press in doubt. */
  get(what: string): string | undefined {
    return this.#requests.get(what);
  }

  /** Keep the request id of a press until it is answered. */
  keep(what: string, request: string): void {
    this.#requests.delete(what);
    this.#requests.set(what, request);
    this.#put();
  }

  forget(what: string): void {
    if (this.#requests.delete(what)) this.#put();
  }

  /** Forget a press by its request id: it was seen what became of it. */
  settle(request: string): void {
    for (const [what, known] of this.#requests) if (known === request) this.forget(what);
  }

  #put(): void {
    const all = [...this.#requests].filter(([what]) => what.length <= LONGEST);
    try {
      this.#storage?.setItem(KEY, JSON.stringify(all.slice(-MOST)));
    } catch {
      // A tab that stores nothing still knows them until it is loaded anew.
    }
  }
}

function stored(storage: Storing | null): [string, string][] {
  try {
    const found: unknown = JSON.parse(storage?.getItem(KEY) ?? "[]");
    return Array.isArray(found) ? found.filter(isPress) : [];
  } catch {
    return [];
  }
}

function isPress(value: unknown): value is [string, string] {
  return Array.isArray(value) && value.length === 2 && value.every((e) => typeof e === "string");
}

function storage(): Storing | null {
  try {
    return window.sessionStorage;
  } catch {
    return null; // a browser may forbid it, and tests of pure parts have no window
  }
}

export const lostPresses = new LostPresses(storage());
