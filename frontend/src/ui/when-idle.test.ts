/**
 * Work that can wait runs when the page is idle, within its time, and not after it was cancelled.
 */
import { afterEach, expect, test, vi } from "vitest";
import { whenIdle } from "./lazy-part";

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

test("the browser is told how long it may wait at most, and when nobody wants it any more", () => {
  const ask = vi.fn((_work: () => void, _options: object) => 7);
  const never = vi.fn();
  vi.stubGlobal("requestIdleCallback", ask);
  vi.stubGlobal("cancelIdleCallback", never);
  const work = vi.fn();
  const stop = whenIdle(work, 900);
  expect(ask.mock.calls).toEqual([[work, { timeout: 900 }]]);
  stop();
  expect(never.mock.calls).toEqual([[7]]);
});

test("where the browser does not say when it is idle, it comes soon", () => {
  vi.useFakeTimers();
  vi.stubGlobal("requestIdleCallback", undefined);
  const [done, not] = [vi.fn(), vi.fn()];
  whenIdle(done, 900);
  whenIdle(not, 900)();
  vi.advanceTimersByTime(600);
  expect(done).toHaveBeenCalledOnce();
  expect(not).not.toHaveBeenCalled();
});
