import fc from "fast-check";
import { expect, test } from "vitest";
import type { RoomLink } from "../sync/room-connection";
import { saveStatusText } from "./save-status";

test("Saved is shown only when nothing waits and the room is live", () => {
  expect(saveStatusText({ state: "live", unsaved: 0, seq: 4 }).words).toBe("Saved");
  expect(saveStatusText({ state: "live", unsaved: 3, seq: 4 }).words).toBe("Saving 3");
  expect(saveStatusText({ state: "live", unsaved: 0, seq: 4 }, false).words).toBe("View only");
  const away = { state: "offline", unsaved: 2, seq: 4 } as const;
  expect(saveStatusText(away).words).toBe("Server away with 2 changes");
  expect(saveStatusText({ ...away, why: "no-network" }).words).toBe("Offline with 2 changes");
  expect(saveStatusText({ ...away, why: "proxy" }).words).toBe("Proxy error with 2 changes");
  expect(saveStatusText({ ...away, why: "not-stored" }).words).toBe(
    "Server cannot store 2 changes",
  );
  expect(saveStatusText({ state: "connecting", unsaved: 0, seq: 0 }).words).toBe("Opening");
  expect(saveStatusText({ state: "live", unsaved: 0, seq: 0 }, false).words).toBe("Opening");
  expect(saveStatusText({ state: "refused", why: "no-such-graph", unsaved: 1, seq: 4 }).words).toBe(
    "This graph is gone · 1 change not saved",
  );
});

test("a room that does not open shows the reason once it is known", () => {
  const link = { state: "offline", unsaved: 0, seq: 0 } as const;
  expect(saveStatusText(link).words).toBe("Opening");
  expect(saveStatusText({ ...link, why: "no-socket" })).toEqual({
    tone: "off",
    words: "No connection",
  });
});

test("text that is not yet in the graph counts as unsaved", () => {
  const link = { state: "live", unsaved: 0, seq: 4 } as const;
  const words = (drafts: Parameters<typeof saveStatusText>[2], room: RoomLink = link) =>
    saveStatusText(room, true, drafts).words;
  expect(words({ writing: 1, waiting: 0 })).toBe("Saving 1");
  expect(words({ writing: 0, waiting: 1 })).toBe("1 draft not saved");
  expect(words({ writing: 0, waiting: 2 })).toBe("2 drafts not saved");
  expect(words({ writing: 1, waiting: 0 }, { ...link, state: "offline" })).toBe(
    "Server away with 1 change",
  );
});

test("Saved is shown exactly when the room is live and nothing waits, in a field or on the way", () => {
  const number = fc.nat({ max: 2 });
  const link: fc.Arbitrary<RoomLink> = fc.record({
    state: fc.constantFrom("connecting", "live", "offline", "refused"),
    unsaved: number,
    seq: number,
  });
  const drafts = fc.record({ writing: number, waiting: number });
  fc.assert(
    fc.property(link, drafts, (room, drafts) => {
      const isDone = room.unsaved + drafts.writing + drafts.waiting === 0;
      const isSaved = room.state === "live" && room.seq > 0 && isDone;
      expect(saveStatusText(room, true, drafts).words === "Saved").toBe(isSaved);
    }),
  );
});
