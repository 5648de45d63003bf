import fc from "fast-check";
import { expect, test } from "vitest";
import type { Visit } from "../../api/runs";
import { barOf, growingSpan, renewalOf, shareOf, ticksOf, wholeSpan } from "./axis";

test("an axis of what goes on grows in steps and always holds all of it", () => {
  expect(growingSpan(57_000)).toBe(60_000);
  const elapsed = fc.integer({ min: 0, max: 100_000_000 });
  fc.assert(
    fc.property(elapsed, elapsed, (a, b) => {
      expect(growingSpan(a)).toBeGreaterThanOrEqual(a);
      if (a <= b) expect(growingSpan(a)).toBeLessThanOrEqual(growingSpan(b));
    }),
  );
});

test("ticks are few, and begin with the start", () => {
  fc.assert(
    fc.property(fc.integer({ min: 1000, max: 50_000_000 }), (span) => {
      const ticks = ticksOf(wholeSpan(span));
      expect(ticks[0]).toBe(0);
      expect(ticks.length).toBeLessThanOrEqual(9);
    }),
  );
});

test("moments outside of an axis stand at its ends", () => {
  const axis = { start: 1000, span: 1000 };
  expect([0, 1500, 9000].map((at) => shareOf(axis, at))).toEqual([0, 0.5, 1]);
});

const iso = (ms: number) => new Date(ms).toISOString();
const visit = (part: Partial<Visit>): Visit => ({
  from: iso(2000),
  not_before: iso(2000),
  until: iso(4000),
  not_after: iso(4000),
  result: "true",
  how: "observed",
  inputs: null,
  ...part,
});
const axis = { start: 0, span: 10_000 };

test("a bar is solid only where something was seen to go on; the rest is where it may have", () => {
  expect(barOf(visit({}), axis, 10_000, true)).toMatchObject({
    sure: { left: 0.2, width: 0.2 },
    maybe: null,
    tone: "true",
  });
  const vague = visit({ not_before: iso(1000), not_after: iso(6000) });
  expect(barOf(vague, axis, 10_000, true)).toMatchObject({
    sure: { left: 0.2, width: 0.2 },
    maybe: { left: 0.1, width: 0.5 },
  });
});

test("what goes on ends where it was last heard of, and without an end it has no outcome", () => {
  const open = visit({ until: null, not_after: null, result: null });
  expect(barOf(open, axis, 5000, false)).toMatchObject({
    open: true,
    tone: "run",
    sure: { left: 0.2, width: 0.3 },
  });
  expect(barOf(open, axis, 5000, true)).toMatchObject({ open: false, tone: "unknown" });
});

test("what grows is drawn in steps that stay small on any axis, and once a second at least", () => {
  fc.assert(
    fc.property(fc.integer({ min: 0, max: 7_200_000 }), (elapsed) => {
      const axis = { start: 0, span: growingSpan(elapsed) };
      expect([250, 500, 1000]).toContain(renewalOf(axis));
      expect(renewalOf(axis) / axis.span).toBeLessThanOrEqual(1 / 40);
    }),
  );
  expect([10_000, 60_000, 120_000].map((span) => renewalOf({ start: 0, span }))).toEqual([
    250, 500, 1000,
  ]);
});
