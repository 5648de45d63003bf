import { beforeEach, expect, test, vi } from "vitest";

/** A tab: its storage, and the page that it shows. */
class Tab {
  readonly storage: Map<string, string>;
  #leave = () => {};

  constructor(copied: Tab | null = null) {
    this.storage = new Map(copied?.storage);
  }

  #open(): void {
    vi.stubGlobal("sessionStorage", {
      getItem: (key: string) => this.storage.get(key) ?? null,
      setItem: (key: string, text: string) => this.storage.set(key, text),
      removeItem: (key: string) => this.storage.delete(key),
    });
  }

  /** Loads the page anew; returns how it sends a press, with the request id that was sent. */
  async load(): Promise<(lose?: boolean) => Promise<string>> {
    this.#open();
    this.#leave();
    const listeners = new Map<string, () => void>();
    vi.stubGlobal("addEventListener", (name: string, heard: () => void) =>
      listeners.set(name, heard),
    );
    vi.resetModules();
    const { sendPress } = await import("./presses");
    this.#leave = () => listeners.get("pagehide")?.();
    return async (lose = false) => {
      let sent = "";
      await sendPress("go on 7", async (request) => {
        sent = request;
        if (lose) throw new TypeError("no answer");
      }).catch(() => {});
      return sent;
    };
  }
}

beforeEach(() => vi.unstubAllGlobals());

test("a lost press counts once with the next one, also after the page was loaded anew", async () => {
  const tab = new Tab();
  let press = await tab.load();
  const first = await press(true);
  expect(await press(true)).toBe(first);
  press = await tab.load();
  expect(await press()).toBe(first);
  expect(await press()).not.toBe(first);
});

test("a copy of the tab shares no lost press, before and after either was loaded anew", async () => {
  const tab = new Tab();
  let press = await tab.load();
  const first = await press(true);
  const copy = new Tab(tab);
  const other = await (await copy.load())(true);
  expect(other).not.toBe(first);
  press = await tab.load();
  expect(await press()).toBe(first);
  expect(await (await copy.load())()).toBe(other);
});

test("a copy of a tab that was loaded anew has none of what that has taken over", async () => {
  const tab = new Tab();
  const first = await (await tab.load())(true);
  await tab.load();
  const copy = new Tab(tab);
  expect(await (await copy.load())()).not.toBe(first);
});
