import { expect, test, vi } from "vitest";
import { Announcer } from "./announcer";

test("a flood becomes a sentence now and then", () => {
  vi.useFakeTimers();
  const announcer = new Announcer();
  const heard: string[] = [];
  announcer.onSay((text) => heard.push(text));
  for (let i = 0; i < 100; i += 1) announcer.say(`action ${i} done`);
  vi.advanceTimersByTime(60);
  expect(heard).toEqual(["action 97 done. action 98 done. action 99 done. and 97 more"]);
  for (let i = 0; i < 10; i += 1) {
    announcer.say("Drive runs");
    vi.advanceTimersByTime(100);
  }
  expect(heard.length).toBe(1);
  vi.advanceTimersByTime(2000);
  expect(heard.slice(1)).toEqual(["Drive runs"]);
  vi.useRealTimers();
});
