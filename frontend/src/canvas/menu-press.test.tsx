// @vitest-environment jsdom
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { useMenuPress } from "./menu-press";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

let root: Root;
let stop: HTMLButtonElement;
const open = vi.fn(() => true);
const stopped = vi.fn();
const clicked = vi.fn();

function Canvas() {
  const press = useMenuPress(open);
  return (
    <main {...press}>
      <p onClickCapture={clicked}>a card</p>
    </main>
  );
}

beforeEach(() => {
  vi.useFakeTimers();
  for (const each of [open, stopped, clicked]) each.mockClear();
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() => root.render(<Canvas />));
  stop = document.body.appendChild(document.createElement("button"));
  stop.addEventListener("click", stopped);
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

/** Dispatches an event as a pointer would; returns whether its usual effect comes. */
function send(on: Element | null, type: string, pointer = "touch", pointerId = 7): boolean {
  const event = new MouseEvent(type, { bubbles: true, cancelable: true });
  Object.defineProperties(event, {
    pointerType: { value: pointer },
    pointerId: { value: pointerId },
  });
  let usual = true;
  act(() => {
    usual = on?.dispatchEvent(event) ?? false;
  });
  return usual;
}

const card = () => document.querySelector("p");

function press(pointer: string): void {
  send(card(), "pointerdown", pointer);
  act(() => void vi.advanceTimersByTime(600));
  expect(open).toHaveBeenCalledTimes(1);
}

/** Taps STOP as a finger does: the click comes only if the end of the touch is not prevented. */
function tapStop(): void {
  send(stop, "pointerdown", "touch", 8);
  send(stop, "pointerup", "touch", 8);
  if (send(stop, "touchend"))
    for (const type of ["mousedown", "mouseup", "click"]) send(stop, type);
}

test("a hand that rests on the canvas keeps no click from STOP, by mouse, key or another finger", () => {
  press("touch");
  send(stop, "mousedown", "mouse", 1);
  send(stop, "mouseup", "mouse", 1);
  send(stop, "click", "mouse", 1);
  stop.click();
  tapStop();
  expect(stopped).toHaveBeenCalledTimes(3);
});

test("a tap on STOP counts at once after a pen was lifted, and after a finger whose card was replaced", () => {
  press("pen");
  send(card(), "pointerup", "pen");
  tapStop();
  act(() => void vi.advanceTimersByTime(1_000));
  tapStop();
  expect(stopped).toHaveBeenCalledTimes(2);
  open.mockClear();
  press("touch");
  card()?.remove();
  send(document.body, "pointerup");
  tapStop();
  expect(stopped).toHaveBeenCalledTimes(3);
});

test("the click of the press that opened a menu is suppressed, and the next one is none of its", () => {
  press("touch");
  send(card(), "pointerup");
  expect(send(card(), "touchend")).toBe(false);
  send(card(), "click");
  expect(clicked).toHaveBeenCalledTimes(0);
  act(() => void vi.advanceTimersByTime(1_000));
  send(card(), "click");
  expect(send(card(), "touchend")).toBe(true);
  expect(clicked).toHaveBeenCalledTimes(1);
});

test("where no menu opens nothing is suppressed", () => {
  open.mockReturnValueOnce(false);
  press("touch");
  send(card(), "pointerup");
  expect(send(card(), "touchend")).toBe(true);
  send(card(), "click");
  expect(clicked).toHaveBeenCalledTimes(1);
});
