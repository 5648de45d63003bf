// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { Notifications, notifications } from "@mantine/notifications";
import { act, useMemo, useSyncExternalStore } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test } from "vitest";
import * as Y from "yjs";
import { PersonContext } from "../../api/people";
import { type EditorContext, EditorReactContext } from "../../edit-actions/editor-context";
import { addAction, addParameter, removeActions, rename, setField } from "../../graph/edit";
import { followGraph } from "../../graph/read";
import { standInForBrowser } from "../../testing/browser";
import { graphIn } from "../../testing/edited-graph";
import { DraftInput } from "../../ui/draft-input";
import { keptTexts, textScope } from "../../ui/kept-texts";
import { LostDrafts } from "./lost-drafts";

standInForBrowser();

const ada = {
  person: { id: "p", name: "Ada", role: "editor" as const },
  visit: 0,
  rename: async () => {},
};

let root: Root;
let doc: Y.Doc;
let colleague: Y.Doc;
let drive: string;

function Page() {
  const source = useMemo(() => followGraph(doc), []);
  const graph = useSyncExternalStore(source.subscribe, source.graph);
  return graph.actions.map(({ key, description }) => (
    <DraftInput
      key={key}
      of={key}
      label="Description"
      value={description}
      onCommit={(text) => setField(doc, key, "description", text)}
    />
  ));
}

beforeEach(() => {
  doc = new Y.Doc();
  colleague = new Y.Doc();
  drive = addAction(doc, { name: "Drive" });
  addParameter(doc, drive, "in", "speed", '{"pvf_type":"number","pvf_value":5.0}');
  Y.applyUpdate(colleague, Y.encodeStateAsUpdate(doc));
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider>
        <PersonContext value={ada}>
          <Notifications transitionDuration={0} />
          <EditorReactContext value={{ doc, mayEdit: true, id: "g" } as EditorContext}>
            <LostDrafts />
            <Page />
          </EditorReactContext>
        </PersonContext>
      </MantineProvider>,
    ),
  );
});

afterEach(() => {
  act(() => notifications.clean());
  act(() => root.unmount());
  document.body.replaceChildren();
  sessionStorage.clear();
});

function type(text: string): void {
  const field = document.querySelector("input");
  if (field === null) throw new Error("no field");
  act(() => {
    field.focus();
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set?.call(field, text);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
}

const hear = () => act(() => Y.applyUpdate(doc, Y.encodeStateAsUpdate(colleague), "network"));
const shown = () => document.body.textContent ?? "";

function press(label: string): void {
  const button = [...document.querySelectorAll("button")].find((each) =>
    each.textContent?.includes(label),
  );
  if (button === undefined) throw new Error(`no button “${label}”`);
  act(() => button.click());
}

test("text typed in an action that another person deletes is offered and can be restored with it", () => {
  type("Drives to the dock");
  removeActions(colleague, [drive]);
  hear();
  expect(shown()).toContain("Drive 0 was deleted while you typed");
  expect(shown()).toContain("Drives to the dock");
  press("Restore it with the text");
  expect(graphIn(doc).actions).toMatchObject([
    { key: drive, name: "Drive", description: "Drives to the dock", inputs: [{ path: "speed" }] },
  ]);
});

test("text that was just written is offered, too, while its field has the focus", () => {
  type("Drives");
  act(() => void window.dispatchEvent(new Event("pagehide")));
  expect(graphIn(doc).actions[0]?.description).toBe("Drives");
  Y.applyUpdate(colleague, Y.encodeStateAsUpdate(doc));
  removeActions(colleague, [drive]);
  hear();
  expect(shown()).toContain("Drive 0 was deleted while you typed");
  press("Restore it with the text");
  expect(graphIn(doc).actions[0]?.description).toBe("Drives");
});

test("a person who typed nothing gets no notice of a deletion", () => {
  removeActions(colleague, [drive]);
  hear();
  expect(shown()).not.toContain("deleted");
});

test("a comment that is not sent is offered when its action is deleted", () => {
  const place = `${textScope("g", "p")}comment/${drive}`;
  keptTexts.set(place, "Mind the step");
  removeActions(colleague, [drive]);
  hear();
  expect(shown()).toContain("Mind the step");
  expect(keptTexts.get(place)).toBe("");
  press("Restore it with the text");
  expect(keptTexts.get(place)).toBe("Mind the step");
  expect(graphIn(doc).actions).toHaveLength(1);
});

test("a person who has renamed a deleted action is told and can restore it", async () => {
  act(() => void rename(doc, drive, "DriveFast"));
  removeActions(colleague, [drive]);
  hear();
  await act(() => new Promise((resolve) => setTimeout(resolve)));
  expect(shown()).toContain("DriveFast 0 was deleted while it was renamed");
  press("Restore it");
  expect(graphIn(doc).actions).toMatchObject([{ name: "DriveFast", inputs: [{ path: "speed" }] }]);
});

test("whoever restores an action is not asked once more about its other texts", async () => {
  const place = `${textScope("g", "p")}comment/${drive}`;
  keptTexts.set(place, "Mind the step");
  type("Drives to the dock");
  removeActions(colleague, [drive]);
  hear();
  expect(shown().match(/Restore it/g)).toHaveLength(2);
  press("Restore it with the text");
  await act(() => new Promise((resolve) => setTimeout(resolve)));
  expect(shown()).not.toContain("Restore it");
  expect(graphIn(doc).actions[0]?.description).toBe("Drives to the dock");
  expect(keptTexts.get(place)).toBe("Mind the step");
});
