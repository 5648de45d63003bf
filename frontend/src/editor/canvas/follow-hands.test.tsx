// @vitest-environment jsdom
import type { ReactFlowInstance } from "@xyflow/react";
import { act, useRef } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { EditorStore, EditorStoreProvider } from "../../canvas/editor-store";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import { useFollowRun } from "./follow-run";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

const setViewport = vi.fn();
const flow = {
  getViewport: () => ({ x: 0, y: 0, zoom: 1 }),
  setViewport,
} as unknown as ReactFlowInstance<CanvasNode, Arrow>;
const now = {
  current: { places: new Map([["far", [5_000, 0] as const]]), sizes: new Map() },
};
const NOTHING = new Map();

function Canvas() {
  const frame = useRef<HTMLDivElement>(null);
  useFollowRun({
    ...{ flow, frame, now, run: "r", progress: NOTHING, blockOf: undefined },
    glide: () => ({ duration: 0 }),
  });
  return <div ref={frame} data-frame />;
}

let root: Root;
let store: EditorStore;

/** The run waits before an action out of view. */
const wait = () =>
  act(() => {
    const run = { id: "r", ended_at: null, actions: { Far_0: { aid: "far" } } };
    const held = { next: [{ action: "Far_0" }] };
    const shown: unknown = { run: { ...run, held }, at: null };
    store.run.set(shown as ReturnType<typeof store.run.now>);
  });

const rest = (ms: number) => act(() => void vi.advanceTimersByTime(ms));

function point(kind: string, buttons: number): void {
  const event = new MouseEvent(kind, { buttons, bubbles: true });
  document.querySelector("[data-frame]")?.dispatchEvent(Object.assign(event, { pointerId: 1 }));
}

beforeEach(() => {
  vi.useFakeTimers();
  setViewport.mockClear();
  store = new EditorStore();
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <EditorStoreProvider store={store}>
        <Canvas />
      </EditorStoreProvider>,
    ),
  );
  rest(60_000);
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.useRealTimers();
});

test("the view goes to the action before which a run waits", () => {
  wait();
  expect(setViewport).toHaveBeenCalledOnce();
});

const ENDS = ["pointerup", "pointercancel", "pointermove"];

test.each(ENDS)("the view rests while something is dragged, and goes there after %s", (kind) => {
  point("pointerdown", 1);
  rest(10_000);
  wait();
  point("pointermove", 1);
  rest(30_000);
  expect(setViewport).not.toHaveBeenCalled();
  point(kind, 0);
  rest(3_000);
  expect(setViewport).not.toHaveBeenCalled();
  rest(3_000);
  expect(setViewport).toHaveBeenCalledOnce();
  rest(60_000);
  expect(setViewport).toHaveBeenCalledOnce();
});
