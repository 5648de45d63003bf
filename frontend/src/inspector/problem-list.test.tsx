// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Problem, Problems } from "../api/graphs";
import { EditorStore, EditorStoreProvider } from "../canvas/editor-store";
import { type EditorContext, EditorReactContext } from "../edit-actions/editor-context";
import { addAction, removeActions } from "../graph/edit";
import { graphNow } from "../graph/edit/document-writes";
import { problemGroups } from "../graph/problems/problem-groups";
import { RoomProvider, useGraph, useRoom } from "../sync/use-room";
import { answerSockets, standInForBrowser } from "../testing/browser";
import { FakeServer } from "../testing/fake-server";
import { ProblemList } from "./problem-list";

standInForBrowser();

let root: Root;
let server: FakeServer;

/** Shows the problems of the graph as it is now: a text without a value is to fill in. */
function Page() {
  const { doc } = useRoom();
  const graph = useGraph();
  const problems = graph.actions.flatMap(({ key, inputs }, i): Problem[] =>
    inputs
      .filter(({ text }) => !text.includes("pvf_value"))
      .map(({ path }) => ({
        code: "H8",
        severity: "error",
        message: "no value",
        where: { aid: key, path: `/actions/${i}/input_parameters/${path}` },
      })),
  );
  const context = { doc, graph, mayEdit: true, select: () => {} } as unknown as EditorContext;
  const told = problemGroups(problems, graph);
  return (
    <EditorReactContext value={context}>
      <ProblemList problems={{ seq: 1, problems } as unknown as Problems} told={told} seq={1} />
    </EditorReactContext>
  );
}

beforeEach(() => {
  vi.useFakeTimers();
  server = new FakeServer();
  const text = '{"pvf_type":"string"}';
  for (const name of ["Ask", "Call", "Say"])
    addAction(server.doc, { name, inputs: [{ path: name.toLowerCase(), text }] });
  server.seq = 1;
  answerSockets(() => server);
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider>
        <RoomProvider url="ws://host/room">
          <EditorStoreProvider store={new EditorStore()}>
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

const fields = () => [...document.querySelectorAll<HTMLInputElement>("[data-fill-in] input")];
const names = () => fields().map((field) => field.getAttribute("aria-label"));

/** Types as a keyboard does: into whatever has the focus, and nowhere else. */
function type(text: string): void {
  const field = document.activeElement;
  if (!(field instanceof HTMLInputElement)) throw new Error(`typed "${text}" into no field`);
  const { set } = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value") ?? {};
  act(() => {
    set?.call(field, field.value + text);
    field.dispatchEvent(new Event("input", { bubbles: true }));
  });
}

const press = (key: string) =>
  act(() => {
    const event = new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true });
    document.activeElement?.dispatchEvent(event);
  });

/** Waits until what was typed is written, and the problems of the graph are counted anew. */
const pause = () => act(() => void vi.advanceTimersByTime(2_000));

const values = () =>
  graphNow(server.doc).actions.flatMap(({ inputs }) =>
    inputs.map(({ text }) => JSON.parse(text).pvf_value),
  );

test("a field stays while somebody writes in it, also after its problem is solved", () => {
  act(() => fields()[0]?.focus());
  type("came");
  pause();
  type(" late");
  pause();
  expect(names()).toEqual(["ask", "call", "say"]);
  expect(values()).toEqual(["came late", undefined, undefined]);
  expect(document.querySelector("h2")?.textContent).toBe("To fill in 2");
  act(() => fields()[0]?.blur());
  expect(names()).toEqual(["call", "say"]);
});

test.each(["Enter", "Tab"])("%s goes on to the next value, so that no key is lost", (key) => {
  act(() => fields()[0]?.focus());
  for (const text of ["one", "two", "three"]) {
    type(text);
    press(key);
    pause();
  }
  if (key === "Enter") type("!");
  pause();
  expect(values()).toEqual(["one", "two", key === "Enter" ? "three!" : "three"]);
});

test("Tab leads from an empty field to what else it has", () => {
  act(() => fields()[0]?.focus());
  press("Tab");
  expect(document.activeElement).toBe(fields()[0]);
});

test("a field goes with its action, and the keyboard stays in the list, in no other field", () => {
  act(() => fields()[1]?.focus());
  type("he");
  act(() => {
    server.broadcast((doc) => removeActions(doc, [graphNow(doc).actions[1]?.key ?? ""]));
    vi.advanceTimersByTime(2_000);
  });
  expect(names()).toEqual(["ask", "say"]);
  expect(document.querySelectorAll("li")).toHaveLength(2);
  expect(document.activeElement).toBe(document.querySelector("[data-problems]"));
});
