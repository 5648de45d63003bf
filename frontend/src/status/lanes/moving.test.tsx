// @vitest-environment jsdom
/** Things that move along an axis are where the time is, and are corrected once a second. */

import { act } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, expect, test, vi } from "vitest";
import { pageClock, tick } from "../../clock/server-clock";
import { growingWay, shareOf, type TimeAxis, useMoving, type Waypoint, WHOLE_WAY } from "./axis";

afterEach(() => vi.useRealTimers());

/** Return how far an element is moved at a share of the axis, in shares of its width. */
function placeAt(way: readonly Waypoint[], share: number): number {
  const moved = ({ transform }: Waypoint) =>
    Number(transform.slice("translateX(".length, -2)) / 100;
  const next = way.findIndex(({ offset }, i) => i > 0 && offset >= share);
  const [from, to] = [way[next - 1] as Waypoint, way[next] as Waypoint];
  const part = to.offset === from.offset ? 1 : (share - from.offset) / (to.offset - from.offset);
  return moved(from) + part * (moved(to) - moved(from));
}

test("a line over a whole axis is where time is", () => {
  for (const share of [0, 0.25, 1]) expect(placeAt(WHOLE_WAY, share)).toBeCloseTo(share);
});

test("a bar that grows ends where time is, and is never too short to be seen", () => {
  for (const left of [0, 0.3, 0.9]) {
    for (const share of [left + 0.004, left + 0.05, 1]) {
      // Its own width is all that is right of its begin.
      const end = left + (1 + placeAt(growingWay(left), share)) * (1 - left);
      expect(end).toBeCloseTo(share);
    }
    expect((1 + placeAt(growingWay(left), left)) * (1 - left)).toBeCloseTo(0.004);
  }
});

test("a way that begins where an axis ends keeps within it", () => {
  for (const { offset } of growingWay(1)) expect(offset).toBeLessThanOrEqual(1);
});

function Moved({ axis }: { axis: TimeAxis }) {
  const element = { current: moved };
  useMoving(element, axis, WHOLE_WAY);
  return null;
}

let moved: HTMLElement;

test("what stood still while the computer slept is put where time is", async () => {
  vi.useFakeTimers({ now: 100_000 });
  const animation = { currentTime: 0, cancel: vi.fn() };
  const animate = vi.fn(() => animation);
  moved = Object.assign(document.createElement("i"), { animate });
  pageClock.hear(100_000, tick());
  const axis = { start: 95_000, span: 10_000 };
  const root = createRoot(document.createElement("div"));
  await act(() => root.render(<Moved axis={axis} />));
  expect(animation.currentTime / axis.span).toBeCloseTo(shareOf(axis, 100_000));
  expect(animate).toHaveBeenCalledWith(
    WHOLE_WAY,
    expect.objectContaining({ duration: axis.span, easing: "steps(40)" }),
  );
  pageClock.hear(103_000, tick()); // as the next beat says after the sleep
  await act(() => vi.advanceTimersByTime(1000));
  expect(animation.currentTime).toBeCloseTo(9_000);
  await act(() => root.unmount());
  expect(animation.cancel).toHaveBeenCalled();
});
