// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { standInForBrowser } from "../../testing/browser";
import { StartButton } from "./start-button";

standInForBrowser();

let root: Root;
const onStart = vi.fn();

function draw(disabled: boolean): void {
  const props = { label: "Run", name: "Run v1", disabled, question: null, onStart };
  act(() =>
    root.render(
      <MantineProvider>
        <StartButton {...props} />
      </MantineProvider>,
    ),
  );
}

beforeEach(() => {
  onStart.mockReset();
  root = createRoot(document.body.appendChild(document.createElement("div")));
  draw(false);
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
});

/** Send an event of a finger at a time, ms; jsdom has no layout, so that the button is at 0, 0. */
function finger(type: string, at: number, x = 0): void {
  const event = new MouseEvent(type, { bubbles: true, cancelable: true, clientX: x });
  Object.defineProperty(event, "timeStamp", { value: at });
  Object.defineProperty(event, "pointerType", { value: "touch" });
  act(() => void document.querySelector("button")?.dispatchEvent(event));
}

test("a finger that holds the button starts, once, though a browser sends no click or sends it late", () => {
  finger("pointerdown", 1_000);
  finger("pointerup", 1_900);
  expect(onStart).toHaveBeenCalledTimes(1);
  finger("click", 1_905);
  expect(onStart).toHaveBeenCalledTimes(1);
});

test("a tap is a click and nothing else; a finger that slips off or scrolls starts nothing", () => {
  finger("pointerdown", 1_000);
  finger("pointerup", 1_080);
  expect(onStart).toHaveBeenCalledTimes(0);
  finger("click", 1_081);
  expect(onStart).toHaveBeenCalledTimes(1);
  finger("pointerdown", 9_000);
  finger("pointerup", 9_900, 400);
  finger("pointerdown", 19_000);
  finger("pointercancel", 19_300);
  finger("pointerup", 19_900);
  expect(onStart).toHaveBeenCalledTimes(1);
});

test("a finger that holds a disabled button starts nothing, nor one whose button is disabled meanwhile", () => {
  finger("pointerdown", 1_000);
  draw(true);
  finger("pointerup", 1_900);
  finger("pointerdown", 9_000);
  draw(false);
  finger("pointerup", 9_900);
  draw(true);
  finger("pointerdown", 19_000);
  finger("pointerup", 19_900);
  expect(onStart).toHaveBeenCalledTimes(0);
});
