import { expect, test } from "vitest";
import { otherPeopleWait, unsavedReason } from "./unsaved-reasons";

test("no reason is given when everything is saved", () => {
  expect(unsavedReason({ state: "live", unsaved: 0, seq: 3 })).toBeNull();
  expect(unsavedReason({ state: "connecting", unsaved: 0, seq: 0 })).toBeNull();
  expect(otherPeopleWait([])).toBeNull();
});

test("a person who works offline reads how many edits wait, and where", () => {
  const link = { state: "offline", unsaved: 2, seq: 3 } as const;
  expect(unsavedReason({ ...link, kept: true })).toBe(
    "The server does not answer. 2 changes wait on this device and survive closing the page. Sent when the server answers again.",
  );
  expect(unsavedReason({ ...link, kept: false })).toContain("wait in this page only: keep it open");
  expect(unsavedReason({ ...link, unsaved: 0 })).toBe("The server does not answer.");
});

test("what is away is named: the network, the server, its proxy, what it stores in", () => {
  const link = { state: "offline", unsaved: 2, kept: true, seq: 3 } as const;
  const waits = "2 changes wait on this device and survive closing the page.";
  expect(unsavedReason({ ...link, why: "no-network" })).toBe(
    `This device has no network. ${waits} Sent when the network is back.`,
  );
  expect(unsavedReason({ ...link, why: "proxy", said: "The proxy answers 502." })).toBe(
    `The proxy answers 502. ${waits} Sent when the server answers again.`,
  );
  expect(unsavedReason({ ...link, why: "not-stored", said: "The database is away." })).toBe(
    `The server cannot store anything at the moment. ${waits} Sent when it can store again.`,
  );
});

test("a refusal says why, and what is with the edits", () => {
  const link = { state: "refused", unsaved: 1, kept: true, seq: 3 } as const;
  expect(unsavedReason({ ...link, why: "session-ended" })).toBe(
    "You are signed out. 1 change waits on this device and survives closing the page.",
  );
  expect(unsavedReason({ ...link, why: "other-person" })).toContain("Somebody else is signed in");
  expect(unsavedReason({ ...link, why: "other-epoch", unsaved: 0 })).toBe(
    "The server went back to an older state of this graph, from a backup perhaps.",
  );
});

test("whose edits wait on a shared device is said by name", () => {
  const others = [
    { id: "1", name: "Ülle", waiting: 1 },
    { id: "2", name: "", waiting: 3 },
  ];
  expect(otherPeopleWait(others)).toBe(
    "1 change of Ülle and 3 changes of a guest wait on this device until they sign in again.",
  );
  expect(otherPeopleWait(others.slice(0, 1))).toBe(
    "1 change of Ülle waits on this device until they sign in again.",
  );
});
