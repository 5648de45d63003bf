import { expect, test } from "vitest";
import { causeSentence } from "./causes";

const text = "Somebody pressed Stop while Lift ran (0.7 s).";
const nameless = { id: "a", name: "", by: "browser" } as const;

test("a person who has taken a name since is called by it", () => {
  expect(causeSentence({ text, author: nameless }, "Ada")).toBe(
    "Ada pressed Stop while Lift ran (0.7 s).",
  );
  expect(causeSentence({ text, author: nameless }, "$&")).toMatch(/^\$& pressed/);
});

test("a person without a name, one of that time, and the robot's facts stay as they were told", () => {
  expect(causeSentence({ text, author: nameless }, "somebody")).toBe(text);
  expect(
    causeSentence({ text: "Ben paused the run.", author: { ...nameless, name: "Ben" } }, "Bob"),
  ).toBe("Ben paused the run.");
  expect(causeSentence({ text: "Somebody else told David to stop.", author: null }, "Ada")).toBe(
    "Somebody else told David to stop.",
  );
});
