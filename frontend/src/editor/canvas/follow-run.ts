/** Moves the view along with a run until the person moves it. */
import type { ReactFlowInstance, Viewport } from "@xyflow/react";
import { type RefObject, useCallback, useEffect, useRef, useState } from "react";
import type { Run } from "../../api/runs";
import { type ExpandedGraphs, useEditorStore } from "../../canvas/editor-store";
import type { Arrow, CanvasNode } from "../../canvas/elements";
import type { Positions, Sizes } from "../../canvas/geometry/ranks";
import { type Bounds, boundsOf } from "../../canvas/geometry/viewport";
import { tick } from "../../clock/server-clock";
import { GRID } from "../../edit-actions/editor-context";
import type { Key } from "../../graph/model";
import type { Progress } from "../../status/progress";
import { useWatched } from "../../ui/watched";

const css = ({ x, y, zoom }: Viewport) => `translate(${x}px, ${y}px) scale(${zoom})`;

/** Return the offset and zoom at which an element is seen now, also during an animation. */
function visibleTransform(element: Element): Viewport {
  const { a, e, f } = new DOMMatrixReadOnly(getComputedStyle(element).transform);
  return { x: e, y: f, zoom: a };
}

/**
 * Moves the view to `next`, at the same zoom, by an animation of `ms`; 0 moves at once. A press or
 * a wheel event during the animation stops it where it is. The browser plays it alone, without the
 * page.
 */
function glideTo(
  flow: ReactFlowInstance<CanvasNode, Arrow>,
  room: HTMLElement,
  next: Viewport,
  ms: number,
): void {
  const sheet = room.querySelector(".react-flow__viewport");
  if (sheet === null || ms === 0) {
    void flow.setViewport(next);
    return;
  }
  const before = visibleTransform(sheet);
  void flow.setViewport(next);
  const timing = { duration: ms, easing: "ease-in-out" };
  const moves = [sheet.animate([{ transform: css(before) }, { transform: css(next) }], timing)];
  // All dots of the background look alike: moving by less than one grid step looks like the whole
  // way.
  const dots = room.querySelector(".react-flow__background");
  const rest = (way: number) => way % (GRID * next.zoom);
  const from = `translate(${rest(before.x - next.x)}px, ${rest(before.y - next.y)}px)`;
  if (dots) moves.push(dots.animate([{ transform: from }, { transform: "none" }], timing));

  const over = new AbortController();
  const hold = () => {
    void flow.setViewport(visibleTransform(sheet));
    for (const move of moves) move.cancel();
  };
  const listening = { capture: true, passive: true, signal: over.signal };
  for (const kind of ["pointerdown", "wheel"] as const)
    room.addEventListener(kind, hold, listening);
  void moves[0]?.finished.catch(() => undefined).finally(() => over.abort());
}

interface FrameRoom {
  readonly width: number;
  readonly height: number;
}

/** Margins, as part of the frame; what runs within them is left where it is. */
const MARGIN = 0.12;
/**
 * The place of the running action in the frame after a move: graphs continue to the right and down,
 * so the view rests longer there.
 */
const AIM = { x: 0.26, y: 0.36 };
const GLIDE = 400; // ms
/** Tolerance for the edges: a viewport may be off by rounding. */
const SLACK = 0.5; // px

/** Return the running actions, the latest first. Actions in a folded frame are replaced by its block. */
export function runningKeys(
  progress: ReadonlyMap<Key, Progress>,
  blockOf?: ReadonlyMap<Key, string>,
): Key[] {
  const keys = [...progress]
    .filter(([, { tone, since }]) => tone === "run" && since !== null)
    .sort(([, a], [, b]) => (b.since ?? 0) - (a.since ?? 0))
    .map(([key]) => blockOf?.get(key) ?? key);
  return [...new Set(keys)];
}

/** Return the actions before which a held run waits, as keys of its graph, in one text. */
export function heldKeys(run: Run | undefined): string {
  const next = run?.ended_at === null ? (run.held?.next ?? []) : [];
  return next.flatMap(({ action }) => run?.actions?.[action]?.aid ?? []).join(" ");
}

interface DrawnPlaces {
  readonly places: Positions;
  readonly sizes: Sizes;
}

/**
 * Replace running actions with expanded graphs by the actions that run inside, with their places on
 * the canvas.
 */
export function runningInside(
  keys: readonly Key[],
  { places, sizes }: DrawnPlaces,
  expanded: Pick<ExpandedGraphs, "partsOf"> | null,
) {
  const found = { keys: [] as Key[], places: new Map(places), sizes: new Map(sizes) };
  for (const key of keys) {
    const [x, y] = places.get(key) ?? [0, 0];
    const parts = expanded?.partsOf(key) ?? [];
    const running = parts.filter((part) => part.progress?.tone === "run" && !part.expanded);
    for (const part of running) {
      found.places.set(part.path, [x + part.x, y + part.y]);
      found.sizes.set(part.path, part);
    }
    found.keys.push(...(running.length > 0 ? running.map(({ path }) => path) : [key]));
  }
  return found;
}

/** Return the viewport that shows a box with margins, at the same zoom; null if it is visible already. */
export function followingViewport(box: Bounds, frame: FrameRoom, view: Viewport): Viewport | null {
  const { zoom } = view;
  const [width, height] = [box.width * zoom, box.height * zoom];
  const [left, top] = [box.x * zoom + view.x, box.y * zoom + view.y];
  const margin = { x: frame.width * MARGIN, y: frame.height * MARGIN };
  const within = (from: number, size: number, margin: number, room: number) => {
    const edge = Math.min(margin, (room - size) / 2) - SLACK;
    return from >= edge && from + size <= room - edge;
  };
  const seen =
    within(left, width, margin.x, frame.width) && within(top, height, margin.y, frame.height);
  if (seen) return null;
  const aim = (size: number, room: number, share: number, margin: number) => {
    const edge = Math.min(margin, (room - size) / 2);
    return Math.max(edge, Math.min(room - size - edge, room * share - size / 2));
  };
  return {
    x: aim(width, frame.width, AIM.x, margin.x) - box.x * zoom,
    y: aim(height, frame.height, AIM.y, margin.y) - box.y * zoom,
    zoom,
  };
}

/**
 * Return the box around all running actions if it fits the frame, else around the one that started
 * last; null without any.
 */
export function followedBox(
  running: readonly Key[],
  places: Positions,
  sizes: Sizes,
  frame: FrameRoom,
  zoom: number,
): Bounds | null {
  const some = (keys: readonly Key[]): Bounds | null => {
    const found: Positions = new Map();
    for (const key of keys) {
      const at = places.get(key);
      if (at) found.set(key, at);
    }
    return boundsOf(found, sizes);
  };
  const all = some(running);
  const fits =
    all !== null &&
    all.width * zoom <= frame.width * 0.8 &&
    all.height * zoom <= frame.height * 0.8;
  return fits ? all : some(running.slice(0, 1));
}

const HANDS_REST = 4_000; // ms without input on the canvas after which the view follows again
const TYPING = "input, textarea, [contenteditable=true], [role=dialog] *";
const LOOK_AGAIN = 1_000; // ms

/** Tracks whether the person is using the canvas or typing; the view does not move then. */
function useHandsOn(frame: RefObject<HTMLElement | null>) {
  const last = useRef(Number.NEGATIVE_INFINITY); // infinity while something is pressed
  useEffect(() => {
    const room = frame.current;
    if (room === null) return;
    const over = new AbortController();
    const heard = { passive: true, capture: true, signal: over.signal };
    const touched = ({ type }: Event) => {
      const until = type === "pointerdown" ? Number.POSITIVE_INFINITY : tick();
      last.current = Math.max(last.current, until);
    };
    const moved = ({ buttons }: PointerEvent) => {
      if (buttons === 0) last.current = Math.min(last.current, tick());
    };
    for (const kind of ["pointerdown", "keydown", "wheel"])
      room.addEventListener(kind, touched, heard);
    for (const kind of ["pointermove", "pointerup", "pointercancel"] as const)
      window.addEventListener(kind, moved, heard);
    return () => over.abort();
  }, [frame]);
  const isBusy = useCallback(
    () => tick() - last.current < HANDS_REST || document.activeElement?.matches(TYPING) === true,
    [],
  );
  const release = useCallback(() => {
    last.current = Number.NEGATIVE_INFINITY;
  }, []);
  return { isBusy, release };
}

interface Followed {
  flow: ReactFlowInstance<CanvasNode, Arrow>;
  frame: RefObject<HTMLDivElement | null>;
  /** Current places and sizes of all elements. */
  now: RefObject<DrawnPlaces>;
  /** The id of the current run; null without one. */
  run: string | null;
  progress: ReadonlyMap<Key, Progress>;
  /** The folded frame that hides each hidden element. */
  blockOf: ReadonlyMap<Key, string> | undefined;
  /** True while a dry-run or the past is shown instead of the run. */
  aside: boolean;
  /** Called when the run has ended, if the view has followed it to its end. */
  onEnd: () => void;
  /** Returns the allowed duration of an animation; 0 if the person prefers no motion. */
  glide: (ms: number) => { duration: number };
}

/**
 * Calls `onEnd` when a run has ended to whose end the view was the run's. Hands on the canvas are waited for.
 * Returns a function for a view that the person has chosen: that one is kept.
 */
function useRunEnd(
  { run, aside, onEnd }: Pick<Followed, "run" | "aside" | "onEnd">,
  lost: boolean,
  isBusy: () => boolean,
) {
  const { run: shown } = useEditorStore();
  const ended = useWatched(shown, (now) =>
    now?.run.ended_at == null || now.at !== null ? null : now.run.id,
  );
  const followed = useRef<string | null>(null);
  useEffect(() => {
    if (aside || lost) followed.current = null;
    else if (run !== null) followed.current = run;
  }, [run, aside, lost]);
  useEffect(() => {
    if (ended === null || run !== null) return;
    let again: ReturnType<typeof setTimeout> | undefined;
    const look = () => {
      if (followed.current !== ended) return;
      if (isBusy()) {
        again = setTimeout(look, LOOK_AGAIN);
        return;
      }
      followed.current = null;
      onEnd();
    };
    look();
    return () => clearTimeout(again);
  }, [ended, run, isBusy, onEnd]);
  return useCallback(() => {
    followed.current = null;
  }, []);
}

/**
 * Keeps running actions in view until the person moves the view; each run starts anew. At its end all is shown.
 */
export function useFollowRun(given: Followed) {
  const { flow, frame, now, run, progress, blockOf, glide } = given;
  const [left, setLeft] = useState<string | null>(null);
  const lost = run !== null && left === run;
  const store = useEditorStore();
  const held = useWatched(store.run, (shown) =>
    shown?.run.id === run && shown?.at === null ? heldKeys(shown.run) : "",
  );
  const begun = run === null || lost ? [] : runningKeys(progress, blockOf);
  // Where nothing runs, a person decides about what waits: they look at that.
  const waiting = lost || held === "" || begun.length > 0 ? [] : held.split(" ");
  const followed = () =>
    runningInside(
      [...begun, ...waiting.map((key) => blockOf?.get(key) ?? key)],
      now.current,
      store.expanded.now(),
    );
  const key = followed().keys.join(" ");
  const { isBusy, release } = useHandsOn(frame);
  const onChosen = useRunEnd(given, lost, isBusy);
  // biome-ignore lint/correctness/useExhaustiveDependencies: only when other actions run
  useEffect(() => {
    const room = frame.current;
    if (run === null || lost || key === "" || room === null) return;
    let again: ReturnType<typeof setTimeout> | undefined;
    const look = () => {
      if (isBusy()) {
        // What waits is still there when the hands rest.
        if (waiting.length > 0) again = setTimeout(look, LOOK_AGAIN);
        return;
      }
      const { keys, places, sizes } = followed();
      const size = { width: room.clientWidth, height: room.clientHeight };
      const here = flow.getViewport();
      const box = followedBox(keys, places, sizes, size, here.zoom);
      const next = box && followingViewport(box, size, here);
      if (next) glideTo(flow, room, next, glide(GLIDE).duration);
    };
    look();
    return () => clearTimeout(again);
  }, [run, lost, key]);
  return {
    /** True while a run goes on that the view no longer follows. */
    lost,
    onPanned: useCallback(() => {
      setLeft(run);
      onChosen();
    }, [run, onChosen]),
    onChosen,
    onFollow: useCallback(() => {
      release();
      setLeft(null);
    }, [release]),
  };
}
