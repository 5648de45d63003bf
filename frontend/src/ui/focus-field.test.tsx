// @vitest-environment jsdom
import { expect, test, vi } from "vitest";
import { focusField, whenThere } from "./focus-field";

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

test("what takes many frames to come still gets the keyboard, and what comes too late does not", () => {
  vi.useFakeTimers({ toFake: ["requestAnimationFrame"] });
  document.body.innerHTML = "";
  const come = vi.fn();
  whenThere("tr", come, 10);
  for (let frame = 0; frame < 5; frame += 1) vi.advanceTimersToNextFrame();
  document.body.innerHTML = "<table><tbody><tr></tr></tbody></table>";
  vi.advanceTimersToNextFrame();
  expect(come).toHaveBeenCalledOnce();
  document.body.innerHTML = "";
  const late = vi.fn();
  whenThere("tr", late, 3);
  for (let frame = 0; frame < 6; frame += 1) vi.advanceTimersToNextFrame();
  document.body.innerHTML = "<table><tbody><tr></tr></tbody></table>";
  vi.advanceTimersToNextFrame();
  expect(late).not.toHaveBeenCalled();
  vi.useRealTimers();
});
