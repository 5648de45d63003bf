// @vitest-environment jsdom
import { act, StrictMode } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { addAction, rename } from "../graph/edit";
import { FakeServer } from "./fake-server";
import {
  type OpenRoom,
  RoomProvider,
  useGraph,
  useGraphPart,
  useLink,
  usePeople,
  useRoom,
  useUndo,
} from "./use-room";

let server: FakeServer;
let root: Root;
let open: OpenRoom;
const drawn = { graph: 0, name: 0 };

beforeEach(() => {
  vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
  server = new FakeServer();
  vi.stubGlobal(
    "WebSocket",
    class {
      constructor(url: string) {
        // biome-ignore lint/correctness/noConstructorReturn: the fake stands in for the browser's
        return server.open(url) as never;
      }
    },
  );
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.unstubAllGlobals();
});

function GraphText() {
  open = useRoom();
  drawn.graph += 1;
  const { state, unsaved } = useLink();
  const names = useGraph().actions.map((action) => action.name);
  const people = usePeople().map((person) => person.name);
  const { canUndo } = useUndo();
  return <p>{[state, unsaved, ...names, ...people, canUndo ? "undo" : ""].join(" ").trim()}</p>;
}

function NameText() {
  drawn.name += 1;
  return <h1>{useGraphPart((graph) => graph.name)}</h1>;
}

const show = (url = "ws://host/room") =>
  act(() =>
    root.render(
      <StrictMode>
        <RoomProvider url={url}>
          <NameText />
          <GraphText />
        </RoomProvider>
      </StrictMode>,
    ),
  );
const text = () => document.querySelector("p")?.textContent;

test("a page shows the link, the graph, the people and undo as they change", () => {
  show();
  expect(text()).toBe("connecting 0");
  act(() => void server.accept());
  expect(text()).toBe("live 0");
  act(() => void addAction(open.doc, { name: "Scan" }));
  expect(text()).toBe("live 0 Scan undo");
  act(() => server.presence(5, 1, { user: { id: "1", name: "Ada", color: "" } }));
  expect(text()).toBe("live 0 Scan Ada undo");
  act(() => void open.undo.undo());
  expect(text()).toBe("live 0 Ada");
});

test("who looks at one part is drawn again only when that part changes", () => {
  show();
  act(() => void server.accept());
  const before = drawn.name;
  act(() => void rename(open.doc, addAction(open.doc, { name: "Scan" }), "Look"));
  expect(drawn.name).toBe(before);
  act(() => void open.doc.getMap("meta").set("name", "other"));
  expect(drawn.name).toBeGreaterThan(before);
  expect(document.querySelector("h1")?.textContent).toBe("other");
});

test("leaving and changing the graph close the room that was open", () => {
  show();
  const first = server.last;
  act(() => void server.accept());
  show("ws://host/other");
  expect(first.readyState).toBe(3);
  const second = server.last;
  expect(second.url).toContain("other");
  act(() => root.render(null));
  expect(second.readyState).toBe(3);
});
