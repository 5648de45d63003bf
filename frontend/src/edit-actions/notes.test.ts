// @vitest-environment jsdom
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { EditorContext } from "./editor-context";
import { details } from "./notes";

const context = { setPanel: () => {} } as unknown as EditorContext;
const form = (content: string) => `<div data-form>${content}</div>`;

function later(): void {
  vi.advanceTimersByTime(200);
}

beforeEach(() => {
  vi.useFakeTimers();
  document.body.innerHTML = '<button id="card"></button><input id="search"><main></main>';
  document.getElementById("card")?.focus();
});

afterEach(() => {
  vi.useRealTimers();
});

function show(content: string): void {
  const main = document.querySelector("main");
  if (main !== null) main.innerHTML = `<section aria-label="Details">${content}</section>`;
}

test("a form that is loaded only now gets the keyboard when it is there", () => {
  details.run(context);
  later();
  const before = '<div data-form style="display: none !important"><input id="graph"></div>';
  show(`<button id="problem"></button>${before}Loading …`);
  later();
  expect(document.activeElement?.id).toBe("card");
  show(`<button id="problem"></button>${form('<input id="name">')}`);
  later();
  expect(document.activeElement?.id).toBe("name");
});

test("whoever types elsewhere by then stays there", () => {
  details.run(context);
  later();
  document.getElementById("search")?.focus();
  show(form('<input id="name">'));
  later();
  expect(document.activeElement?.id).toBe("search");
});

test("where nothing can be typed the first button gets it", () => {
  show(form('<button id="fix"></button>'));
  details.run(context);
  later();
  expect(document.activeElement?.id).toBe("fix");
});
