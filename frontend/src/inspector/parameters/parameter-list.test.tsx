// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { EditorStore, EditorStoreProvider } from "../../canvas/editor-store";
import { type EditorContext, EditorReactContext } from "../../edit-actions/editor-context";
import { addAction, connect } from "../../graph/edit";
import { graphNow } from "../../graph/edit/document-writes";
import { RoomProvider, useGraph, useRoom } from "../../sync/use-room";
import { answerSockets, standInForBrowser } from "../../testing/browser";
import { FakeServer } from "../../testing/fake-server";
import { ParameterList } from "./parameter-list";

standInForBrowser();

let root: Root;
let store: EditorStore;
let server: FakeServer;

function Page() {
  const { doc } = useRoom();
  const graph = useGraph();
  const [action] = graph.actions;
  return (
    <EditorReactContext value={{ doc, graph, select: () => {} } as unknown as EditorContext}>
      {action && <ParameterList action={action} side="in" />}
    </EditorReactContext>
  );
}

beforeEach(() => {
  vi.useFakeTimers();
  store = new EditorStore();
  server = new FakeServer();
  const text = '{"pvf_type":"string"}';
  const say = addAction(server.doc, { name: "Say", inputs: [{ path: "text", text }] });
  const hear = addAction(server.doc, {
    name: "Hear",
    outputs: [
      { path: "words", text },
      { path: "loudness", text: '{"pvf_type":"number"}' },
    ],
  });
  connect(server.doc, hear, say);
  server.seq = 1;
  answerSockets(() => server);
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider>
        <RoomProvider url="ws://host/room">
          <EditorStoreProvider store={store}>
            <Page />
          </EditorStoreProvider>
        </RoomProvider>
      </MantineProvider>,
    ),
  );
  act(() => {
    server.accept();
    vi.advanceTimersByTime(100);
  });
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

function found<T extends HTMLElement>(selector: string): T {
  const element = document.querySelector<T>(selector);
  if (!element) throw new Error(`no ${selector}`);
  return element;
}

test("a field for a parameter's name keeps the caret while one thinks about the name", () => {
  act(() => found("[aria-label='What the parameter text is']").click());
  const field = found<HTMLInputElement>("section[aria-label='What the parameter text is'] input");
  act(() => {
    field.focus();
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value")?.set?.call(field, "wo");
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
  act(() => void vi.advanceTimersByTime(2_000));
  expect(document.activeElement).toBe(field);
  act(() => field.blur());
  const [action] = graphNow(server.doc).actions;
  expect(action?.inputs.map(({ path }) => path)).toEqual(["wo"]);
});

test("an input takes an output that fits, says why not of another, and shows what it gets", () => {
  act(() => found("[aria-label='Take text from an output']").click());
  const options = [...document.querySelectorAll<HTMLElement>("[role=option]")];
  expect(options.map((option) => option.textContent)).toEqual([
    " Hear.wordsstring",
    " Hear.loudnesstakes string, not number",
  ]);
  expect(options[1]?.dataset.comboboxDisabled).toBe("true");
  act(() => options[0]?.click());
  const [relation] = graphNow(server.doc).relations;
  expect(relation?.remap).toEqual([{ source: "words", target: "text" }]);
  expect(found("[data-given]").textContent).toBe("Hear.words");
});

test("while a field is in focus, those that give and take it stand out", () => {
  act(() => found("[aria-label='Take text from an output']").click());
  act(() => document.querySelector<HTMLElement>("[role=option]")?.click());
  const names = new Map(graphNow(server.doc).actions.map(({ key, name }) => [key, name]));
  const lit = () => {
    const touched = store.touched.now();
    return (
      touched &&
      [touched.producers, touched.consumers].map((set) => [...set].map((key) => names.get(key)))
    );
  };
  act(() => found("[aria-label='What the parameter text is']").focus());
  expect(lit()).toEqual([["Hear"], ["Say"]]);
  act(() => found("[aria-label='What the parameter text is']").blur());
  expect(lit()).toBeNull();
});
