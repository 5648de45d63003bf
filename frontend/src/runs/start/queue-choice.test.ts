import { expect, test } from "vitest";
import type { Preflight, PreflightItem } from "../../api/robots";
import { mayWait } from "./queue-choice";

const look = (...blocked: string[]): Preflight[] => [
  {
    items: blocked.map((code) => ({ code, verdict: "blocked", overridable: false })),
  } as unknown as Preflight,
];

test("the queue is offered where a robot is not free, and waiting mends all else that is in the way", () => {
  expect(mayWait(undefined)).toBe(false);
  expect(mayWait(look())).toBe(false);
  expect(mayWait(look("free"))).toBe(true);
  expect(mayWait(look("free", "watched", "baton"))).toBe(true);
  expect(mayWait(look("baton"))).toBe(false);
  expect(mayWait(look("free", "right"))).toBe(false);
  const accepted = { code: "others", verdict: "blocked", overridable: true } as PreflightItem;
  expect(mayWait([{ ...look("free")[0], items: [accepted] } as Preflight])).toBe(false);
});
