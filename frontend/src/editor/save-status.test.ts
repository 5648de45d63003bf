import { expect, test } from "vitest";
import { saveStatusText } from "./save-status";

test("saved is said only when nothing waits and the room is live", () => {
  expect(saveStatusText({ state: "live", unsaved: 0, seq: 4 }).words).toBe("Saved");
  expect(saveStatusText({ state: "live", unsaved: 3, seq: 4 }).words).toBe("Saving 3");
  expect(saveStatusText({ state: "live", unsaved: 0, seq: 4 }, false).words).toBe("View only");
  expect(saveStatusText({ state: "offline", unsaved: 2, seq: 4 }).words).toBe(
    "Offline with 2 changes",
  );
  expect(saveStatusText({ state: "connecting", unsaved: 0, seq: 0 }).words).toBe("Opening");
  expect(saveStatusText({ state: "live", unsaved: 0, seq: 0 }, false).words).toBe("Opening");
  expect(saveStatusText({ state: "refused", why: "no-such-graph", unsaved: 1, seq: 4 }).words).toBe(
    "This graph is gone · 1 change not saved",
  );
});

test("a room that does not open says why, once that is known", () => {
  const link = { state: "offline", unsaved: 0, seq: 0 } as const;
  expect(saveStatusText(link).words).toBe("Opening");
  expect(saveStatusText({ ...link, why: "no-socket" })).toEqual({
    tone: "off",
    words: "No connection",
  });
});
