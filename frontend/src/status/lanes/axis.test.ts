import fc from "fast-check";
import { expect, test } from "vitest";
import type { Visit } from "../../api/runs";
import {
  barOf,
  growingSpan,
  originOf,
  partOf,
  rangeOf,
  renewalOf,
  shareOf,
  type TimeRange,
  ticksOf,
  turnedTo,
  wholeSpan,
  zoomed,
} from "./axis";

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
      const ticks = ticksOf({ start: 77, span: wholeSpan(span) });
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

const wholes = fc.integer({ min: 1000, max: 50_000_000 });

test("a part that is zoomed stays within the run, holds its moment, and comes back to the whole", () => {
  const shares = fc.double({ min: 0, max: 1, noNaN: true });
  fc.assert(
    fc.property(wholes, shares, fc.nat(20), (span, share, times) => {
      const whole = { start: 777, span };
      const around = 777 + share * span;
      let range: TimeRange | null = null;
      for (let n = 0; n < times; n++) range = zoomed(range, whole, around, 0.5);
      if (range !== null) {
        expect(range.from).toBeGreaterThanOrEqual(777);
        expect(range.until).toBeLessThanOrEqual(777 + span + 1);
        expect(range.until - range.from).toBeGreaterThanOrEqual(999);
        expect(around).toBeGreaterThanOrEqual(range.from - 1);
        expect(around).toBeLessThanOrEqual(range.until + 1);
      }
      for (let n = 0; n <= times; n++) range = zoomed(range, whole, around, 2);
      expect(range).toBeNull();
    }),
  );
});

test("a part shows few ticks that are counted from the start of the run, and all of them are on it", () => {
  fc.assert(
    fc.property(wholes, fc.nat(50_000_000), fc.nat(50_000_000), (span, from, length) => {
      const axis = partOf({ start: 777, span }, { from, until: from + length });
      expect(originOf(axis)).toBe(777);
      const ticks = ticksOf(axis);
      expect(ticks.length).toBeLessThanOrEqual(9);
      for (const t of ticks) {
        expect(777 + t).toBeGreaterThanOrEqual(axis.start);
        expect(777 + t).toBeLessThanOrEqual(axis.start + axis.span);
      }
    }),
  );
});

test("a part that an address names beyond the run, or longer than it, is the whole", () => {
  const whole = { start: 1000, span: 10_000 };
  expect(partOf(whole, { from: 13_000, until: 20_000 })).toBe(whole);
  expect(partOf(whole, { from: -9000, until: 900 })).toBe(whole);
  expect(partOf(whole, { from: 0, until: 1e12 })).toBe(whole);
  expect(partOf(whole, { from: 5000, until: 1e12 })).toEqual({
    start: 5000,
    span: 6000,
    origin: 1000,
  });
});

test("an address that names no part, or one of no length, shows the whole", () => {
  expect(rangeOf(0, 1000)).toEqual({ from: 0, until: 1000 });
  for (const [from, until] of [
    [0, 999],
    [Number.NaN, 5000],
    [0, Number.NaN],
    [0, Number.POSITIVE_INFINITY],
    [0.5, 5000],
    [1e300, 2e300],
  ] as const)
    expect(rangeOf(from, until)).toBeNull();
});

test("a part goes on to the page that holds a moment, and is as long as before", () => {
  fc.assert(
    fc.property(
      fc.nat(100_000),
      fc.integer({ min: 1, max: 50_000 }),
      fc.integer({ min: -500_000, max: 500_000 }),
      (from, length, at) => {
        const turned = turnedTo({ from, until: from + length }, at);
        expect(turned.until - turned.from).toBe(length);
        expect(turned.from).toBeLessThanOrEqual(at);
        expect(turned.until).toBeGreaterThanOrEqual(at);
      },
    ),
  );
});

test("nothing is drawn of a visit outside of the part that is shown, and no more than its share inside", () => {
  const part = partOf({ start: 0, span: 10_000 }, { from: 3000, until: 5000 });
  expect(barOf(visit({}), part, 10_000, true)).toMatchObject({ sure: { left: 0, width: 0.5 } });
  const later = partOf({ start: 0, span: 10_000 }, { from: 5000, until: 7000 });
  expect(barOf(visit({}), later, 10_000, true)).toBeNull();
  const vague = visit({ not_after: iso(6000) });
  expect(barOf(vague, later, 10_000, true)?.maybe).toEqual({ left: 0, width: 0.5 });
});
