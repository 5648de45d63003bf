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
const onEnd = vi.fn();

function Canvas({ run = "r", aside = false }: { run?: string | null; aside?: boolean }) {
  const frame = useRef<HTMLDivElement>(null);
  const { onPanned, onFollow, onChosen } = useFollowRun({
    ...{ flow, frame, now, run, progress: NOTHING, blockOf: undefined },
    ...{ aside, onEnd, glide: () => ({ duration: 0 }) },
  });
  hands = { onPanned, onFollow, onChosen };
  return <div ref={frame} data-frame />;
}
let hands: Pick<ReturnType<typeof useFollowRun>, "onPanned" | "onFollow" | "onChosen">;

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

const draw = (run: string | null, aside = false) =>
  act(() =>
    root.render(
      <EditorStoreProvider store={store}>
        <Canvas run={run} aside={aside} />
      </EditorStoreProvider>,
    ),
  );

/** The run ends: the canvas is told first, as on the page. */
function end(aside = false): void {
  draw(null, aside);
  act(() => {
    const shown: unknown = { run: { id: "r", ended_at: "2026-01-01T10:00:00Z" }, at: null };
    store.run.set(shown as ReturnType<typeof store.run.now>);
  });
}

const rest = (ms: number) => act(() => void vi.advanceTimersByTime(ms));

function point(kind: string, buttons: number): void {
  const event = new MouseEvent(kind, { buttons, bubbles: true });
  document.querySelector("[data-frame]")?.dispatchEvent(Object.assign(event, { pointerId: 1 }));
}

beforeEach(() => {
  vi.useFakeTimers();
  setViewport.mockClear();
  onEnd.mockClear();
  store = new EditorStore();
  root = createRoot(document.body.appendChild(document.createElement("div")));
  draw("r");
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

test("all is shown once when the run has ended", () => {
  end();
  expect(onEnd).toHaveBeenCalledOnce();
  draw(null);
  rest(60_000);
  expect(onEnd).toHaveBeenCalledOnce();
});

test("at the end of a run the view rests under a hand, and shows all after it", () => {
  point("pointerdown", 1);
  end();
  rest(30_000);
  expect(onEnd).not.toHaveBeenCalled();
  point("pointerup", 0);
  rest(6_000);
  expect(onEnd).toHaveBeenCalledOnce();
});

test.each([
  ["moves the view", () => hands.onPanned()],
  ["zooms or goes to an action", () => hands.onChosen()],
])("a person who %s keeps that view at the end of the run", (_, choose) => {
  act(choose);
  end();
  rest(60_000);
  expect(onEnd).not.toHaveBeenCalled();
});

test("whoever moves the view, and then follows the run again, sees all at its end", () => {
  act(() => hands.onPanned());
  act(() => hands.onFollow());
  end();
  expect(onEnd).toHaveBeenCalledOnce();
});

test("a run that ends behind a dry-run or the past moves nothing", () => {
  draw(null, true);
  end(true);
  draw(null);
  rest(60_000);
  expect(onEnd).not.toHaveBeenCalled();
});
