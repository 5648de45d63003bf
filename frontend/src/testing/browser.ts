/** Stand-ins for parts of a browser that jsdom lacks, and for the server at the other end of its sockets. */
import { vi } from "vitest";
import type { SignedIn } from "../api/people";
import type { Role } from "../api/session";
import type { FakeServer } from "./fake-server";

/** Let React and Mantine find what they ask of a browser. Call it where a test file is read. */
export function standInForBrowser(): void {
  const media = { matches: false, addEventListener: () => {}, removeEventListener: () => {} };
  vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
  vi.stubGlobal("matchMedia", () => media);
  vi.stubGlobal(
    "ResizeObserver",
    class {
      observe() {}
      unobserve() {}
      disconnect() {}
    },
  );
  Object.assign(document, { fonts: new EventTarget() });
}

/** Let each new WebSocket be a socket of the server that is there then. */
export function answerSockets(server: () => FakeServer): void {
  function answered(url: string) {
    return server().open(url);
  }
  vi.stubGlobal("WebSocket", answered);
}

/** Return Ada, signed in with this role. */
export const adaAs = (role: Role): SignedIn => ({
  person: { id: "a", name: "Ada", role },
  visit: 0,
  rename: async () => {},
});
