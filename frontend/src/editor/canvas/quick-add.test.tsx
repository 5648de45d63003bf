// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act, type ComponentProps, type ComponentType } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as Y from "yjs";
import type { EditorContext } from "../../edit-actions/editor-context";
import { READY_TEMPLATES } from "../../graph/edit";
import { graphNow } from "../../graph/edit/document-writes";
import { EMPTY_GRAPH } from "../../graph/model";
import { standInForBrowser } from "../../testing/browser";
import { boundedPart } from "../../ui/lazy-part";
import { TypingField } from "../../ui/typed-ahead";
import { candidates, QuickAdd } from "./quick-add";

standInForBrowser();

let root: Root;
let doc: Y.Doc;

function open(Part: ComponentType<ComponentProps<typeof QuickAdd>> = QuickAdd): Promise<void> {
  const context = {
    doc,
    graph: EMPTY_GRAPH,
    positions: () => new Map(),
    select: () => {},
    view: { reveal: () => {}, focus: () => {} },
  } as unknown as EditorContext;
  return act(async () =>
    root.render(
      <MantineProvider>
        <Part
          context={context}
          request={{ screen: [0, 0], at: [0, 0], from: null }}
          known={[{ name: "Drive" }, { name: "Look" }, { name: "Say" }]}
          onClose={() => {}}
        />
      </MantineProvider>,
    ),
  );
}

beforeEach(() => {
  doc = new Y.Doc();
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
});

function found<T extends Element>(selector: string): T {
  const element = document.querySelector<T>(selector);
  if (!element) throw new Error(`no ${selector}`);
  return element;
}

const fire = (on: Element, event: Event) => act(() => void on.dispatchEvent(event));
const enter = () =>
  fire(found("input"), new KeyboardEvent("keydown", { key: "Enter", bubbles: true }));
const names = () => graphNow(doc).actions.map(({ name }) => name);

test("what is typed while the field is loading is its text, and Enter takes it then", async () => {
  let resolve = (_: typeof QuickAdd) => {};
  const promise = new Promise<typeof QuickAdd>((done) => {
    resolve = done;
  });
  await open(boundedPart(() => promise, { waiting: <TypingField /> }));
  const field = found<HTMLInputElement>("input");
  expect(document.activeElement).toBe(field);
  const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set;
  write?.call(field, "Lo");
  fire(field, new Event("input", { bubbles: true }));
  const shortcuts = vi.fn();
  window.addEventListener("keydown", shortcuts);
  enter();
  window.removeEventListener("keydown", shortcuts);
  expect(shortcuts).not.toHaveBeenCalled();
  expect(names()).toEqual([]);
  await act(async () => resolve(QuickAdd));
  await vi.waitFor(async () => {
    await act(async () => {});
    expect(names()).toEqual(["Look"]);
  });
});

test("Enter takes the option chosen by keys, also when the list opens under a resting pointer", async () => {
  await open();
  fire(found("[role=option]:last-child"), new Event("pointerover", { bubbles: true }));
  enter();
  expect(names()).toEqual(["Drive"]);
});

test("moving the pointer over the list chooses an option", async () => {
  await open();
  fire(found("[role=option]:last-child"), new Event("pointermove", { bubbles: true }));
  enter();
  expect(names()).toEqual(["Say"]);
});

test("Enter that ends a composition adds nothing, the next one does", async () => {
  await open();
  const composing = { key: "Enter", bubbles: true, isComposing: true };
  fire(found("input"), new KeyboardEvent("keydown", composing));
  // Safari tells of it after the composition has ended, by this number alone.
  fire(
    found("input"),
    new KeyboardEvent("keydown", { ...composing, isComposing: false, keyCode: 229 }),
  );
  expect(names()).toEqual([]);
  enter();
  expect(names()).toEqual(["Drive"]);
});

test("a ready-made action is found by its title, and comes last while nothing is typed", () => {
  const known = [...READY_TEMPLATES, { name: "Drive" }, { name: "Work" }];
  expect(
    candidates(known, "")
      .map(({ name }) => name)
      .slice(0, 2),
  ).toEqual(["Drive", "Work"]);
  expect(candidates(known, "conf").map(({ name, title = "" }) => [name, title])).toEqual([
    ["AaConfirm", "Confirm"],
    ["conf", ""],
  ]);
  expect(candidates(known, "aaw")[0]?.name).toBe("AaWait");
});
