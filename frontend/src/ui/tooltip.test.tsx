// @vitest-environment jsdom
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Tooltip } from "./tooltip";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

let root: Root;

beforeEach(() => {
  vi.useFakeTimers();
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

function draw(props: { disabled?: boolean; onFocus?: boolean } = {}): void {
  act(() =>
    root.render(
      <Tooltip label="What it does" {...props}>
        <button type="button">Do</button>
      </Tooltip>,
    ),
  );
}

const button = () => document.querySelector("button");
const shown = () => document.querySelector("[role=tooltip]")?.textContent ?? null;
const wait = (ms: number) => act(() => vi.advanceTimersByTime(ms));

function pointer(type: string, target: Element | null, pointerType = "mouse"): void {
  const event = new MouseEvent(type, { bubbles: true });
  act(() => void target?.dispatchEvent(Object.assign(event, { pointerType })));
}

test("a tooltip comes when the mouse rests, and goes with it", () => {
  draw();
  pointer("pointerover", button());
  wait(200);
  expect(shown()).toBeNull();
  wait(200);
  expect(shown()).toBe("What it does");
  expect(button()?.getAttribute("aria-describedby")).toBe(
    document.querySelector("[role=tooltip]")?.id,
  );
  pointer("pointerout", button());
  expect(shown()).toBeNull();
  expect(button()?.hasAttribute("aria-describedby")).toBe(false);
});

test("a mouse that only passes, and a finger, show nothing", () => {
  draw();
  pointer("pointerover", button());
  wait(100);
  pointer("pointerout", button());
  pointer("pointerover", button(), "touch");
  wait(2000);
  expect(shown()).toBeNull();
});

test("Escape puts a tooltip away", () => {
  draw();
  pointer("pointerover", button());
  wait(400);
  act(() => void document.dispatchEvent(new KeyboardEvent("keydown", { key: "Escape" })));
  expect(shown()).toBeNull();
});

test("a tooltip goes when the mouse is elsewhere, even where nobody said that it left", () => {
  draw();
  pointer("pointerover", button());
  wait(400);
  act(() => void document.body.dispatchEvent(new MouseEvent("pointerover", { bubbles: true })));
  expect(shown()).toBeNull();
});

test("what is told nowhere else comes with the focus too", () => {
  draw({ onFocus: true });
  act(() => button()?.focus());
  expect(shown()).toBe("What it does");
  act(() => button()?.blur());
  expect(shown()).toBeNull();
});

test("a tooltip that says nothing is not shown", () => {
  draw({ disabled: true });
  pointer("pointerover", button());
  wait(400);
  expect(shown()).toBeNull();
});
