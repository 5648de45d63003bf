// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeAll, beforeEach, expect, test, vi } from "vitest";
import { standInForBrowser } from "../testing/browser";
import { HoldButton, HoldQuestion } from "./hold-button";

standInForBrowser();

let root: Root;
const onHeld = vi.fn();

function button(): HTMLButtonElement {
  const found = document.querySelector("button");
  if (!found) throw new Error("no button");
  return found;
}

beforeAll(() => HoldQuestion.preload());

function show(disabled: boolean): void {
  const props = { label: "Start", name: "Start v1", question: "Sure?", disabled, onHeld };
  act(() =>
    root.render(
      <MantineProvider>
        <HoldButton {...props} />
      </MantineProvider>,
    ),
  );
}

beforeEach(() => {
  vi.useFakeTimers();
  onHeld.mockReset();
  const place = document.body.appendChild(document.createElement("div"));
  root = createRoot(place);
  show(false);
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

const fire = (event: Event) => act(() => void button().dispatchEvent(event));
const wait = (ms: number) => act(() => vi.advanceTimersByTime(ms));
const pointer = (type: string) => new MouseEvent(type, { bubbles: true, button: 0 });
const key = (type: string) => new KeyboardEvent(type, { key: "Enter", bubbles: true });

test("a button that is disabled while it is held starts nothing, also if it is enabled again", () => {
  fire(pointer("pointerdown"));
  wait(300);
  show(true);
  wait(100);
  show(false);
  wait(2_000);
  expect(onHeld).not.toHaveBeenCalled();
});

test("a tap starts nothing", () => {
  fire(pointer("pointerdown"));
  wait(200);
  fire(pointer("pointerup"));
  wait(2000);
  expect(onHeld).not.toHaveBeenCalled();
});

test("held by pointer it starts once", () => {
  fire(pointer("pointerdown"));
  wait(700);
  fire(pointer("pointerup"));
  wait(2000);
  expect(onHeld).toHaveBeenCalledTimes(1);
});

test("held by Enter it starts once", () => {
  fire(key("keydown"));
  wait(700);
  fire(key("keyup"));
  expect(onHeld).toHaveBeenCalledTimes(1);
});

test("a screen reader's click asks first", () => {
  fire(new MouseEvent("click", { bubbles: true, detail: 0 }));
  wait(500);
  expect(onHeld).not.toHaveBeenCalled();
  const confirm = [...document.querySelectorAll("button")].find(
    (other) => other.textContent === "Start v1",
  );
  act(() => confirm?.click());
  expect(onHeld).toHaveBeenCalledTimes(1);
});
