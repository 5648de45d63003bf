import fc from "fast-check";
import { expect, test } from "vitest";
import { ServerOffset } from "./server-clock";

const HOUR = 3_600_000;

test("a browser whose clock is hours off is put right by the first answer, to two seconds", () => {
  for (const off of [-3 * HOUR, 3 * HOUR, -1_700_000_000_000]) {
    const server = 1_800_000_000_000; // at tick 0
    const offset = new ServerOffset(server + off);
    const stamp = Math.floor((server + 540) / 1000) * 1000; // as headers are: whole seconds
    offset.hearRoundTrip(stamp, 500, 600);
    expect(Math.abs(offset.now() - server)).toBeLessThan(2_100);
    offset.hear(server + 1_000, 1_020);
    expect(offset.now()).toBe(server - 20);
    offset.hearRoundTrip(stamp, 500, 600); // a stamp that is less exact takes nothing back
    expect(offset.now()).toBe(server - 20);
  }
});

test("a browser whose clock is right keeps it until something exact is heard", () => {
  const offset = new ServerOffset(1_800_000_000_000);
  offset.hearRoundTrip(1_800_000_000_000, 500, 600);
  expect(offset.now()).toBe(1_800_000_000_000);
});

test("however late messages come, the offset is off by the least delay of the newest at most", () => {
  const delays = fc.array(fc.integer({ min: 0, max: 60_000 }), { minLength: 1, maxLength: 30 });
  fc.assert(
    fc.property(delays, fc.integer({ min: -HOUR, max: HOUR }), (all, wrong) => {
      const server = 1_800_000_000_000;
      const offset = new ServerOffset(server + wrong);
      all.forEach((delay, i) => {
        const sent = i * 1_000;
        offset.hear(server + sent, sent + delay);
      });
      expect(server - offset.now()).toBe(Math.min(...all.slice(-10)));
    }),
  );
});

test("a server's clock that is set back is followed", () => {
  const offset = new ServerOffset(0);
  for (let i = 0; i < 20; i += 1) offset.hear(5 * HOUR + i, i);
  for (let i = 20; i < 30; i += 1) offset.hear(2 * HOUR + i, i);
  expect(offset.now()).toBe(2 * HOUR);
});

test("a stamp that is no time changes nothing", () => {
  const offset = new ServerOffset(7);
  offset.hear(Number.NaN, 1);
  offset.hearRoundTrip(Number.NaN, 1, 2);
  expect(offset.now()).toBe(7);
});
