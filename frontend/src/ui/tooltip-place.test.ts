/** Tooltips stay in the window, and their arrows on what they tell of. */
import { expect, test } from "vitest";
import { tooltipPlace } from "./tooltip";

const size = { width: 100, height: 20 };

test("a tooltip stands above the middle of what it tells of", () => {
  const place = tooltipPlace({ left: 200, top: 300, width: 40, height: 30 }, size, 1000);
  expect(place).toEqual({ left: 170, top: 273, arrow: 50, below: false });
});

test("a tooltip of something at the upper edge stands below it", () => {
  const place = tooltipPlace({ left: 200, top: 10, width: 40, height: 30 }, size, 1000);
  expect(place).toMatchObject({ top: 47, below: true });
});

test("a tooltip at the side stays in the window, and its arrow on what it tells of", () => {
  const right = tooltipPlace({ left: 960, top: 300, width: 40, height: 30 }, size, 1000);
  expect(right).toMatchObject({ left: 892, arrow: 88 });
  const left = tooltipPlace({ left: 0, top: 300, width: 40, height: 30 }, size, 1000);
  expect(left).toMatchObject({ left: 8, arrow: 12 });
});
