// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { DraftInput } from "./draft-input";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
vi.stubGlobal("matchMedia", () => ({
  matches: false,
  addEventListener: () => {},
  removeEventListener: () => {},
}));

let root: Root;
const onCommit = vi.fn<(value: string) => void>();

beforeEach(() => {
  vi.useFakeTimers();
  onCommit.mockReset();
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

const show = (value: string) =>
  act(() =>
    root.render(
      <MantineProvider>
        <DraftInput label="Name" value={value} onCommit={onCommit} />
      </MantineProvider>,
    ),
  );

function field(): HTMLInputElement {
  const found = document.querySelector("input");
  if (!found) throw new Error("no field");
  return found;
}

function type(text: string): void {
  act(() => {
    field().focus();
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set?.call(field(), text);
    field().dispatchEvent(new Event("input", { bubbles: true }));
  });
}

const pause = () => act(() => void vi.advanceTimersByTime(1_000));

test("what was written in a pause is not written once more over what a colleague wrote since", () => {
  show("old");
  type("mine");
  pause();
  expect(onCommit.mock.calls).toEqual([["mine"]]);
  show("mine");
  show("theirs");
  act(() => field().blur());
  expect(onCommit.mock.calls).toEqual([["mine"]]);
  expect(field().value).toBe("theirs");
});

test("the same text typed once more is written once more", () => {
  show("old");
  type("mine");
  pause();
  show("theirs");
  type("mine!");
  type("mine");
  act(() => field().blur());
  expect(onCommit.mock.calls).toEqual([["mine"], ["mine"]]);
});

test("a field that goes before the pause is over writes what was typed", () => {
  show("old");
  type("mine");
  act(() => root.render(null));
  expect(onCommit.mock.calls).toEqual([["mine"]]);
});
