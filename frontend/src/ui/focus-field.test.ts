// @vitest-environment jsdom
import { expect, test, vi } from "vitest";
import { focusField } from "./focus-field";

test("the keyboard comes to the field of the form, not to its like in what goes away", () => {
  vi.useFakeTimers({ toFake: ["requestAnimationFrame"] });
  vi.stubGlobal("CSS", { escape: (text: string) => text });
  Element.prototype.scrollIntoView = () => {};
  document.body.innerHTML = '<div data-field="a|in/x"><input id="listed"></div>';
  focusField("a|in/x");
  document.body.innerHTML = "";
  vi.advanceTimersToNextFrame();
  document.body.innerHTML = '<div data-field="a|in/x"><button></button><input id="form"></div>';
  vi.advanceTimersToNextFrame();
  expect(document.activeElement?.id).toBe("form");
  vi.useRealTimers();
});
