// @vitest-environment jsdom
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { focusCard } from "./use-viewport";

beforeEach(() => {
  vi.useFakeTimers();
  vi.stubGlobal("CSS", { escape: (text: string) => text });
  document.body.innerHTML = '<input id="search"><input id="name"><main></main>';
});

afterEach(() => {
  vi.useRealTimers();
  vi.unstubAllGlobals();
});

function found(selector: string): HTMLElement {
  const element = document.querySelector<HTMLElement>(selector);
  if (!element) throw new Error(`no ${selector}`);
  return element;
}

function draw(): void {
  found("main").innerHTML = '<div class="react-flow__node" data-id="a" tabindex="0"></div>';
  vi.advanceTimersByTime(50);
}

test("a card that is rendered some frames later gets the focus after the search has closed", () => {
  found("#search").focus();
  focusCard(found("main"), "a", 12);
  found("#search").remove();
  draw();
  expect(document.activeElement).toBe(found("[data-id=a]"));
});

test("a card that is rendered late takes no focus from a field focused meanwhile", () => {
  found("#search").focus();
  focusCard(found("main"), "a", 12);
  found("#search").remove();
  found("#name").focus();
  draw();
  expect(document.activeElement).toBe(found("#name"));
});
