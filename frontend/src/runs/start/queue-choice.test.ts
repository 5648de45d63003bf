import { expect, test } from "vitest";
import type { QueueEntry } from "../../api/queue";
import type { Preflight, PreflightItem } from "../../api/robots";
import { codesOfWaiting, isBusy, mayWait, othersWords } from "./queue-choice";

const item = (code: string, codes: readonly string[] = []): PreflightItem => ({
  ...{ code, verdict: "blocked", text: "", problems: [], folder: null },
  ...{ codes: [...codes], overridable: codes.length > 0 },
});
const look = (...blocked: (string | PreflightItem)[]): Preflight[] => [
  {
    items: blocked.map((each) => (typeof each === "string" ? item(each) : each)),
  } as unknown as Preflight,
];

test("a robot is busy where something goes on there, whoever has started it", () => {
  expect(isBusy(undefined)).toBe(false);
  expect(isBusy(look("baton", "rest"))).toBe(false);
  expect(isBusy(look("baton", "free"))).toBe(true);
  expect(isBusy(look(item("quiet", ["quiet"])))).toBe(true);
});

test("a start may wait where waiting mends all that is in the way, or its person says why not", () => {
  expect(mayWait(undefined)).toBe(false);
  expect(mayWait(look())).toBe(true);
  expect(mayWait(look("free", "watched", "baton", "approved"))).toBe(true);
  expect(mayWait(look("free", "right"))).toBe(false);
  expect(mayWait(look("free", item("others", ["others"])))).toBe(true);
});

test("a start that waits overrides what a person accepts, and not what it waits for", () => {
  const looks = look(item("quiet", ["quiet"]), item("others", ["others"]), "free");
  expect(codesOfWaiting(looks)).toEqual(["others"]);
});

test("who starts is told which others wait for the same robots", () => {
  const entry = (graph_name: string, name: string, ...robots: string[]) =>
    ({ graph_name, author: { name }, robots }) as unknown as QueueEntry;
  const entries = [entry("lift", "Ben", "David"), entry("dry", "Ben"), entry("go", "", "Eve")];
  expect(othersWords(entries, ["Frank"])).toBe("");
  expect(othersWords(entries, ["David"])).toBe(
    "1 start waits for David: lift (Ben). A start now goes before it.",
  );
  expect(othersWords(entries, ["David", "Eve"])).toContain("2 starts wait for David, Eve");
  const many = Array.from({ length: 5 }, (_, i) => entry(`g${i}`, "Ann", "David"));
  expect(othersWords(many, ["David"])).toContain(
    "g2 (Ann) and 2 more. A start now goes before them.",
  );
});
