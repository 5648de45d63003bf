// @vitest-environment jsdom
import { expect, test, vi } from "vitest";
import { frameScheduler } from "./frame-scheduler";

const nextFrame = () => new Promise((done) => requestAnimationFrame(done));

test("changes between two frames are told once", async () => {
  const { soon } = frameScheduler();
  const tell = vi.fn();
  for (let n = 0; n < 40; n += 1) soon(tell);
  expect(tell).not.toHaveBeenCalled();
  await nextFrame();
  expect(tell).toHaveBeenCalledOnce();
  soon(tell);
  await nextFrame();
  expect(tell).toHaveBeenCalledTimes(2);
});

test("a listener is not called again for a while", async () => {
  const { soon } = frameScheduler(100);
  const times: number[] = [];
  const tell = () => times.push(performance.now());
  soon(tell);
  await nextFrame();
  expect(times.length).toBe(1);
  soon(tell);
  await vi.waitUntil(() => times.length === 2);
  expect((times[1] ?? 0) - (times[0] ?? 0)).toBeGreaterThanOrEqual(99);
});

test("a page without frames is told too", async () => {
  vi.stubGlobal("requestAnimationFrame", () => 0); // as in a hidden tab
  const { soon } = frameScheduler();
  await new Promise<void>((told) => soon(told));
  vi.unstubAllGlobals();
});

test("a page that was left is told nothing any more", async () => {
  const { soon, close } = frameScheduler();
  const tell = vi.fn();
  soon(tell);
  close();
  await nextFrame();
  expect(tell).not.toHaveBeenCalled();
});
