// @vitest-environment jsdom
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { restAfterLostFields } from "./focus-field";

let stop: () => void;
const onRest = vi.fn();
const commands: string[] = [];
const command = ({ key }: { key: string }) => void commands.push(key);

beforeEach(() => {
  onRest.mockReset();
  commands.length = 0;
  stop = restAfterLostFields(onRest);
  window.addEventListener("keydown", command);
});

afterEach(() => {
  stop();
  window.removeEventListener("keydown", command);
  document.body.replaceChildren();
});

function field(kind = "input"): HTMLElement {
  const made = document.body.appendChild(document.createElement(kind));
  made.focus();
  made.dispatchEvent(new Event("input", { bubbles: true }));
  return made;
}

function press(key: string, init: KeyboardEventInit = {}): void {
  const target = document.activeElement ?? document.body;
  const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true, ...init });
  target.dispatchEvent(event);
}

test.each(["input", "textarea", "select"])(
  "keys rest when the %s that has the focus is taken away",
  (kind) => {
    field(kind).remove();
    for (const key of ["n", "Delete", "Enter", " ", "/"]) press(key);
    press("z", { ctrlKey: true });
    expect(commands).toEqual([]);
    expect(onRest).toHaveBeenCalledTimes(1);
  },
);

test.each([
  ["Escape", () => press("Escape"), ["Escape"]],
  ["Tab", () => press("Tab"), ["Tab"]],
  [
    "a pointer",
    () => void document.body.dispatchEvent(new Event("pointerdown", { bubbles: true })),
    [],
  ],
])("%s ends the rest", (_, act, heard) => {
  field().remove();
  press("n");
  act();
  press("n");
  expect(commands).toEqual([...heard, "n"]);
});

test("the key of Stop never rests", () => {
  field().remove();
  press(".", { ctrlKey: true });
  press("ю", { ctrlKey: true, code: "Period" });
  expect(commands).toEqual([".", "ю"]);
});

test("keys do not rest after a field that its person has left, or ended by Enter", async () => {
  const first = field();
  press("Enter");
  first.remove();
  press("n");
  const second = field();
  second.blur();
  await Promise.resolve();
  second.remove();
  press("m");
  expect(commands).toEqual(["Enter", "n", "m"]);
});

test("who goes on typing after Enter is typing again", () => {
  const area = field("textarea");
  press("Enter");
  area.dispatchEvent(new Event("input", { bubbles: true }));
  area.remove();
  press("n");
  expect(commands).toEqual(["Enter"]);
});

test("in another field keys are typed", () => {
  field().remove();
  press("n");
  field();
  press("m");
  expect(commands).toEqual(["m"]);
});
