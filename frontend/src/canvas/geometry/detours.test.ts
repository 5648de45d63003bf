import { expect, test } from "vitest";
import { laneBack, laneFor } from "./detours";

const card = (x: number, y: number) => ({ x, y, width: 208, height: 80 });

test("a free way needs no lane", () => {
  expect(laneFor({ x: 100, y: 80 }, { x: 104, y: 200 }, [card(400, 100)])).toBeNull();
});

test("a card in the way is passed on its nearer side", () => {
  expect(laneFor({ x: 30, y: 80 }, { x: 104, y: 400 }, [card(0, 200)])).toBe(-30);
  expect(laneFor({ x: 150, y: 80 }, { x: 104, y: 400 }, [card(0, 200)])).toBe(238);
});

test("a way back up is no matter of lanes", () => {
  expect(laneFor({ x: 30, y: 400 }, { x: 104, y: 0 }, [card(0, 200)])).toBeNull();
});

test("the way back goes through the gap, or round the left", () => {
  expect(laneBack(card(0, 0), card(300, 0), [])).toBe(254);
  expect(laneBack(card(0, 400), card(20, 0), [])).toBeLessThan(-30);
  expect(laneBack(card(0, 400), card(20, 0), [card(-60, 200)])).toBeLessThan(-90);
});
