// @vitest-environment jsdom
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { EditorContext } from "./editor-context";
import { details } from "./notes";

/** An editor in which one action, or nothing, is chosen. */
const contextWith = (...keys: string[]) =>
  ({
    setPanel: () => {},
    selection: new Set(keys),
    graph: { actions: [{ key: "lift" }], relations: [], notes: [], positions: new Map() },
  }) as unknown as EditorContext;
const context = contextWith();
const form = (content: string, of = "graph") => `<div data-form="${of}">${content}</div>`;

function later(): void {
  vi.advanceTimersByTime(200);
}

beforeEach(() => {
  vi.stubGlobal("CSS", { escape: (text: string) => text }); // jsdom has none
  vi.useFakeTimers();
  document.body.innerHTML = '<button id="card"></button><input id="search"><main></main>';
  document.getElementById("card")?.focus();
});

afterEach(() => {
  vi.unstubAllGlobals();
  vi.useRealTimers();
});

function show(content: string): void {
  const main = document.querySelector("main");
  if (main !== null) main.innerHTML = `<section aria-label="Details">${content}</section>`;
}

test("a form that is loaded only now gets the keyboard when it is there", () => {
  details.run(context);
  later();
  const before = '<div data-form="graph" style="display: none !important"><input id="graph"></div>';
  show(`<button id="problem"></button>${before}Loading …`);
  later();
  expect(document.activeElement?.id).toBe("card");
  show(`<button id="problem"></button>${form('<input id="name">')}`);
  later();
  expect(document.activeElement?.id).toBe("name");
});

test("a person who types elsewhere by then keeps the focus there", () => {
  details.run(context);
  later();
  document.getElementById("search")?.focus();
  show(form('<input id="name">'));
  later();
  expect(document.activeElement?.id).toBe("search");
});

test("the first button gets the focus where there is no field", () => {
  show(form('<button id="fix"></button>'));
  details.run(context);
  later();
  expect(document.activeElement?.id).toBe("fix");
});

test("the form of the selection before is not given the keyboard", () => {
  show(form('<input id="name">'));
  details.run(contextWith("lift"));
  later();
  expect(document.activeElement?.id).toBe("card");
  show(form('<input id="lift-name">', "lift"));
  later();
  expect(document.activeElement?.id).toBe("lift-name");
});
