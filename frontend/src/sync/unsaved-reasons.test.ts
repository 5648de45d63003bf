import { expect, test } from "vitest";
import { othersWait, whyNot } from "./unsaved-reasons";

test("nothing is said when everything is saved", () => {
  expect(whyNot({ state: "live", unsaved: 0, seq: 3 })).toBeNull();
  expect(whyNot({ state: "connecting", unsaved: 0, seq: 0 })).toBeNull();
  expect(othersWait([])).toBeNull();
});

test("who works offline reads how many edits wait, and where", () => {
  const link = { state: "offline", unsaved: 2, seq: 3 } as const;
  expect(whyNot({ ...link, kept: true })).toBe(
    "The server does not answer. 2 changes wait on this device and survive closing the page. Sent when it is back.",
  );
  expect(whyNot({ ...link, kept: false })).toContain("wait in this page only: keep it open");
  expect(whyNot({ ...link, unsaved: 0 })).toBe("The server does not answer.");
});

test("a refusal says why, and what is with the edits", () => {
  const link = { state: "refused", unsaved: 1, kept: true, seq: 3 } as const;
  expect(whyNot({ ...link, why: "session-ended" })).toBe(
    "You are signed out. 1 change waits on this device and survives closing the page.",
  );
  expect(whyNot({ ...link, why: "other-person" })).toContain("Somebody else is signed in");
  expect(whyNot({ ...link, why: "other-epoch", unsaved: 0 })).toBe(
    "The server went back to an older state of this graph, from a backup perhaps.",
  );
});

test("whose edits wait on a shared device is said by name", () => {
  const others = [
    { id: "1", name: "Ülle", waiting: 1 },
    { id: "2", name: "", waiting: 3 },
  ];
  expect(othersWait(others)).toBe(
    "1 change of Ülle and 3 changes of a guest wait on this device until they sign in again.",
  );
  expect(othersWait(others.slice(0, 1))).toBe(
    "1 change of Ülle waits on this device until they sign in again.",
  );
});
