// @vitest-environment jsdom
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PersonContext } from "../api/people";
import { RoomProvider } from "../sync/use-room";
import { answerSockets } from "../testing/browser";
import { FakeServer } from "../testing/fake-server";
import { useEditor } from "./use-editor";

let server: FakeServer;
let root: Root;

beforeEach(() => {
  vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
  server = new FakeServer();
  answerSockets(() => server);
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.unstubAllGlobals();
});

const ada = {
  person: { id: "p", name: "Ada", role: "editor" as const },
  visit: 0,
  rename: async () => {},
};

const drawn: string[] = [];

function Page() {
  const { context } = useEditor("g", () => {});
  drawn.push(`${context.mayEdit ? "may edit" : "looks at"} ${context.graph.name || "nothing"}`);
  return null;
}

test("a graph cannot be edited before it has arrived", async () => {
  server.doc.getMap("meta").set("name", "untitled");
  server.seq = 1;
  act(() =>
    root.render(
      <QueryClientProvider client={new QueryClient()}>
        <PersonContext value={ada}>
          <RoomProvider url="ws://host/room">
            <Page />
          </RoomProvider>
        </PersonContext>
      </QueryClientProvider>,
    ),
  );
  expect(new Set(drawn)).toEqual(new Set(["looks at nothing"]));
  await act(async () => {
    server.accept();
    await new Promise(requestAnimationFrame);
  });
  expect(drawn.at(-1)).toBe("may edit untitled");
  expect(drawn).not.toContain("may edit nothing");
});
