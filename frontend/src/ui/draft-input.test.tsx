// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { standInForBrowser } from "../testing/browser";
import { DraftChoice, DraftInput } from "./draft-input";
import { type LostDraft, pendingDrafts } from "./drafts";

standInForBrowser();

let root: Root;
const onCommit = vi.fn<(value: string) => boolean>();

beforeEach(() => {
  vi.useFakeTimers();
  onCommit.mockReset().mockReturnValue(true);
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

const render = (field: React.ReactNode) =>
  act(() => root.render(<MantineProvider>{field}</MantineProvider>));
const show = (value: string) =>
  render(<DraftInput label="Name" value={value} onCommit={onCommit} />);

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

const hide = () => {
  vi.spyOn(document, "visibilityState", "get").mockReturnValue("hidden");
  document.dispatchEvent(new Event("visibilitychange"));
  vi.restoreAllMocks();
};
const number = (draft: string) => (/^\d+$/.test(draft) ? null : "A number.");

test.each([
  ["the page goes", () => void window.dispatchEvent(new Event("pagehide"))],
  ["the page goes out of sight", hide],
  [
    "the page is asked whether it may go",
    () => void window.dispatchEvent(new Event("beforeunload")),
  ],
])("a draft counts as unsaved, and is written when %s", (_, leave) => {
  show("old");
  type("mine");
  expect(pendingDrafts.counts()).toEqual({ writing: 1, waiting: 0 });
  act(leave);
  expect(onCommit.mock.calls).toEqual([["mine"]]);
  expect(pendingDrafts.counts()).toEqual({ writing: 0, waiting: 0 });
  pause();
  act(() => field().blur());
  expect(onCommit).toHaveBeenCalledTimes(1);
});

test("a field that waits for leaving is written when the page goes, too", () => {
  render(<DraftChoice label="Robot" data={["a", "b"]} value="a" onCommit={onCommit} />);
  type("lab");
  pause();
  expect(onCommit).not.toHaveBeenCalled();
  act(() => void window.dispatchEvent(new Event("pagehide")));
  expect(onCommit.mock.calls).toEqual([["lab"]]);
});

test("Enter writes a field that waits for leaving, which keeps the caret", async () => {
  render(<DraftChoice label="Robot" data={["a", "b"]} value="a" onCommit={onCommit} />);
  type("lab");
  const field = document.querySelector("input");
  field?.focus();
  await act(async () => {
    field?.dispatchEvent(new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
  });
  expect(onCommit.mock.calls).toEqual([["lab"]]);
  expect(pendingDrafts.counts()).toEqual({ writing: 0, waiting: 0 });
  expect(document.activeElement).toBe(field);
});

test("a draft that does not fit waits for its person, who is asked before the page goes", () => {
  render(<DraftInput label="Number" value="1" check={number} onCommit={onCommit} />);
  const leave = () => {
    const event = new Event("beforeunload", { cancelable: true });
    act(() => void window.dispatchEvent(event));
    return event.defaultPrevented;
  };
  expect(leave()).toBe(false);
  type("x");
  expect(pendingDrafts.counts()).toEqual({ writing: 0, waiting: 1 });
  expect(leave()).toBe(true);
  expect(onCommit).not.toHaveBeenCalled();
  type("12");
  expect(leave()).toBe(false);
  expect(onCommit.mock.calls).toEqual([["12"]]);
});

test("the draft is written before other listeners look whether everything is stored", () => {
  const seen: unknown[] = [];
  const look = () => seen.push(onCommit.mock.calls.length);
  window.addEventListener("beforeunload", look); // as the room does, long before anybody types
  show("old");
  type("mine");
  act(() => void window.dispatchEvent(new Event("beforeunload")));
  window.removeEventListener("beforeunload", look);
  expect(seen).toEqual([1]);
});

test("Enter and Escape of an input method neither write nor discard a draft", () => {
  show("old");
  type("mine");
  for (const key of ["Enter", "Escape"]) {
    const composing = new KeyboardEvent("keydown", { key, bubbles: true, isComposing: true });
    act(() => void field().dispatchEvent(composing));
  }
  expect(onCommit).not.toHaveBeenCalled();
  expect(field().value).toBe("mine");
});

test.each([
  ["has no place any more", "gone"],
  ["does not fit when its field goes", "unfit"],
] as const)("a draft that %s is offered to its person", (_, why) => {
  const lost: LostDraft[] = [];
  const stop = pendingDrafts.onLost((draft) => lost.push(draft));
  onCommit.mockReturnValue(false);
  const check = () => (why === "unfit" ? "It never fits." : null);
  render(<DraftInput of="a1" label="Name" value="old" check={check} onCommit={onCommit} />);
  type("mine");
  act(() => root.render(null));
  stop();
  expect(lost.map(({ text, of, why }) => ({ text, of, why }))).toEqual([
    { text: "mine", of: "a1", why },
  ]);
  expect(pendingDrafts.counts()).toEqual({ writing: 0, waiting: 0 });
});
