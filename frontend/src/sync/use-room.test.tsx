// @vitest-environment jsdom
import { act, StrictMode } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { addAction, rename } from "../graph/edit";
import { answerSockets } from "../testing/browser";
import { FakeEditStore } from "../testing/fake-device";
import { FakeServer } from "../testing/fake-server";
import type { PersistenceOptions } from "./room-connection";
import {
  type OpenRoom,
  type OthersWaiting,
  RoomProvider,
  type StrandedEditsChoice,
  useEditors,
  useFollowing,
  useGraph,
  useGraphPart,
  useLink,
  useOthersWaiting,
  usePeople,
  useRoom,
  useStrandedEdits,
  useThrottledLink,
  useUndo,
} from "./use-room";

let server: FakeServer;
let root: Root;
let open: OpenRoom;
const drawn = { graph: 0, name: 0 };

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
/** Runs a step and waits for the next frame, in which the page draws what the server sent. */
const heard = (step: () => void) =>
  act(async () => {
    step();
    await new Promise(requestAnimationFrame);
  });
const text = () => document.querySelector("p")?.textContent;

test("a page shows the link, the graph, the people and undo as they change", async () => {
  show();
  expect(text()).toBe("connecting 0");
  await heard(() => void server.accept());
  expect(text()).toBe("live 0");
  await heard(() => void addAction(open.doc, { name: "Scan" }));
  expect(text()).toBe("live 0 Scan undo");
  await heard(() => server.presence(5, 1, { user: { id: "1", name: "Ada", color: "" } }));
  expect(text()).toBe("live 0 Scan Ada undo");
  act(() => void open.undo.undo());
  expect(text()).toBe("live 0 Ada");
});

test("a component that reads one part is drawn again only when that part changes", async () => {
  show();
  await heard(() => void server.accept());
  const before = drawn.name;
  act(() => void rename(open.doc, addAction(open.doc, { name: "Scan" }), "Look"));
  expect(drawn.name).toBe(before);
  act(() => void open.doc.getMap("meta").set("name", "other"));
  expect(drawn.name).toBeGreaterThan(before);
  expect(document.querySelector("h1")?.textContent).toBe("other");
});

test("changes by others between two frames are drawn once", async () => {
  show();
  await heard(() => void server.accept());
  const before = drawn.graph;
  await heard(() => {
    for (let n = 0; n < 20; n += 1) {
      server.broadcast((doc) => doc.getMap("actions").set(`AAAAAAAAAAA${n % 10}`, `Action ${n}`));
    }
  });
  expect(drawn.graph - before).toBe(2); // each twice in strict mode
  expect(open.source.graph().actions.length).toBe(10);
});

test("leaving and changing the graph close the room that was open", async () => {
  show();
  const first = server.last;
  await heard(() => void server.accept());
  show("ws://host/other");
  expect(first.readyState).toBe(3);
  const second = server.last;
  expect(second.url).toContain("other");
  act(() => root.render(null));
  expect(second.readyState).toBe(3);
});

let choice: StrandedEditsChoice | null;
let left: OthersWaiting;
let goAfter: (client: number | null) => void;

function Together() {
  open = useRoom();
  choice = useStrandedEdits();
  const { state, unsaved } = useLink();
  const names = useGraph().actions.map((action) => action.name);
  const editors = useEditors("k|name").map((person) => person.name);
  left = useOthersWaiting();
  const waiting = left.others.map(({ name, waiting }) => `${name}:${waiting}`);
  const { whom, follow } = useFollowing();
  goAfter = follow;
  const place = open.following.view();
  const parts = [state, unsaved, ...names, ...editors, ...waiting, whom && `at ${place?.x}`];
  return <p>{parts.join(" ").trim()}</p>;
}

const flush = () => act(() => new Promise((done) => setTimeout(done, 5)));

async function showKept(keep: PersistenceOptions) {
  vi.stubGlobal("fetch", async () => Response.json({ person: keep.person }));
  act(() =>
    root.render(
      <StrictMode>
        <RoomProvider url="ws://host/room" keep={{ ...keep }}>
          <Together />
        </RoomProvider>
      </StrictMode>,
    ),
  );
  await flush();
}

const leave = async () => {
  act(() => root.render(null));
  await flush();
};

let states: string[];

function States() {
  const { state, seq } = useThrottledLink();
  useUndo();
  states.push(`${state} ${seq}`);
  return null;
}

const ADA = { id: "a", name: "Ada" };
const MARI = { id: "m", name: "Mari" };

test("a page knows who edits a field, where somebody looks, and whose edits wait here", async () => {
  const device = new FakeEditStore();
  await showKept({ graph: "g", person: MARI, device });
  act(() => void addAction(open.doc, { name: "Scan" }));
  await leave();
  await showKept({ graph: "g", person: ADA, device });
  await heard(() => void server.accept());
  const view = { x: 7, y: 8, zoom: 1 };
  await heard(() => server.presence(5, 1, { user: MARI, editing: "k|name", view }));
  await flush();
  act(() => goAfter(5));
  expect(text()).toBe("live 0 Mari Mari:1 at 7");
  await heard(() => server.presence(5, 2, null));
  expect(text()).toBe("live 0 Mari:1");
});

test("an editor is not drawn again when all that is new is that its edits are kept", async () => {
  states = [];
  vi.stubGlobal("fetch", async () => Response.json({ person: ADA }));
  const keep = { graph: "g", person: ADA, device: new FakeEditStore() };
  act(() =>
    root.render(
      <RoomProvider url="ws://host/room" keep={keep}>
        <Together />
        <States />
      </RoomProvider>,
    ),
  );
  await flush();
  await heard(() => open.room.reconnect());
  expect(open.room.link().kept).toBe(true);
  expect(states).toEqual(["connecting 0"]);
  await heard(() => void server.accept());
  await flush();
  expect(states.at(-1)).toBe("live 0");
});

test("edits of another person on this device can be read and dropped, and are never sent", async () => {
  const device = new FakeEditStore();
  await showKept({ graph: "g", person: MARI, device });
  act(() => void addAction(open.doc, { name: "Scan" }));
  await leave();
  await showKept({ graph: "g", person: ADA, device });
  await heard(() => void server.accept());
  await flush();
  const [stranded] = await left.read("m");
  expect([...(stranded?.difference.actions.values() ?? [])]).toContain("Scan");
  expect(text()).toBe("live 0 Mari:1");
  await act(() => left.forget("m"));
  expect(text()).toBe("live 0");
  expect(device.waiting).toBe(0);
  expect(server.doc.getMap("actions").size).toBe(0);
});

test("edits on a history that the server left are made again there, or dropped, as the person says", async () => {
  for (const decision of ["apply", "drop"] as const) {
    const device = new FakeEditStore();
    server = new FakeServer("one");
    await showKept({ graph: "g", person: ADA, device });
    await heard(() => void server.accept());
    act(() => void addAction(open.doc, { name: "Lost" }));
    act(() => server.last.end(1006));
    act(() => void addAction(open.doc, { name: "Mine" }));
    await leave();
    server = new FakeServer("two");
    await showKept({ graph: "g", person: ADA, device });
    await heard(() => void server.accept());
    await flush();
    await heard(() => void server.accept());
    await flush();
    expect(text()).toBe("live 0");
    expect(choice?.stranded.edits).toBe(1);
    const { stranded } = choice as StrandedEditsChoice;
    await act(async () => {
      await (decision === "apply" ? choice?.apply(stranded.difference) : choice?.drop());
    });
    await flush();
    expect(choice).toBeNull();
    expect(text()).toBe(decision === "apply" ? "live 0 Mine" : "live 0");
    expect(device.waiting).toBe(0);
    await leave();
  }
});
