/** The view of the canvas: its first view, Fit, showing single actions, and following a run. */

import type { ReactFlowInstance } from "@xyflow/react";
import { type RefObject, useCallback, useEffect, useLayoutEffect, useMemo, useRef } from "react";
import type { LineStore } from "../../canvas/arrows/line-store";
import type { PlaceMap } from "../../canvas/editor-store";
import type { Arrow, CanvasNode, Folding } from "../../canvas/elements";
import { hiding } from "../../canvas/folding/folding";
import { CARD, type Positions, pillSize, type Sizes } from "../../canvas/geometry/ranks";
import {
  boundsOf,
  type CanvasArea,
  firstViewport,
  fitsAt,
  type Insets,
  isSameViewport,
  READABLE,
  type Viewport,
  viewportShowing,
  wholeViewport,
} from "../../canvas/geometry/viewport";
import type { CanvasView, EditorContext } from "../../edit-actions/editor-context";
import { type Direction, ENTRY, EXIT, type Key, type Position } from "../../graph/model";
import type { Progress } from "../../status/progress";
import { useStableCallback } from "../../ui/hooks";
import { useFollowRun } from "./follow-run";

interface FoldedCanvas {
  readonly folding: Folding | null;
  readonly places: Positions;
  readonly sizes: Sizes;
}

/**
 * Return a function that unfolds all frames that hide given elements. A selected element that is
 * moved or added into a folded frame unfolds it, too.
 */
export function useUnfolding(context: EditorContext, canvas: FoldedCanvas) {
  const { graph, folded, fold, selection } = context;
  const { folding, places, sizes } = canvas;
  const unfoldRound = useStableCallback((keys: readonly Key[]) => {
    if (folding === null) return;
    const frames = hiding(graph, folded, keys, places, sizes);
    if (frames.length > 0) fold(frames, false);
  });
  // Else the selected element would vanish under the person's hands.
  const before = useRef({ folded, folding });
  useEffect(() => {
    const was = before.current;
    before.current = { folded, folding };
    if (folding === null || was.folded !== folded) return;
    const isGone = (key: string) => folding.blockOf.has(key) && !was.folding?.blockOf.has(key);
    unfoldRound([...selection].filter(isGone));
  }, [folded, folding, selection, unfoldRound]);
  return { blockOf: folding?.blockOf, unfoldRound };
}

/** `first`: as a graph opens. `whole`: all of it, however small it becomes. */
type Goal = "first" | "whole";

interface ViewportInput {
  flow: ReactFlowInstance<CanvasNode, Arrow>;
  frame: RefObject<HTMLDivElement | null>;
  /** Places as they are drawn. */
  places: Positions;
  sizes: Sizes;
  lines: LineStore;
  /** Maps a place in the document to its place in the drawing. */
  toView: PlaceMap;
  /** The folded frame that hides each hidden element. */
  blockOf: ReadonlyMap<Key, string> | undefined;
  /** Unfolds the frames that hide these elements. */
  unfoldRound: (keys: readonly Key[]) => void;
  direction: Direction;
  phone: boolean;
  /** The contents of the canvas: nothing before the graph has arrived, then only its two ends, or cards. */
  opens: "nothing" | "ends" | "cards";
  progress: ReadonlyMap<Key, Progress>;
  /** The id of the current run; null without one. */
  run: string | null;
  /** True while a dry-run or the past is shown instead of the run. */
  aside: boolean;
  /** The place of the pointer over the canvas, on screen. */
  pointer: RefObject<Position | null>;
}

/**
 * Return the size of the canvas, and what bars and drawers cover at each side (`data-covers` names
 * the side).
 */
function roomOf(element: HTMLElement): CanvasArea {
  const box = element.getBoundingClientRect();
  const covered = { left: 0, top: 0, right: 0, bottom: 0 };
  for (const over of document.querySelectorAll<HTMLElement>("[data-covers]")) {
    const { left, top, right, bottom, width, height } = over.getBoundingClientRect();
    const apart = left >= box.right || right <= box.left || top >= box.bottom || bottom <= box.top;
    if (apart || width === 0 || height === 0) continue;
    const depth = {
      left: right - box.left,
      top: bottom - box.top,
      right: box.right - left,
      bottom: box.bottom - top,
    };
    const side = over.dataset.covers as keyof Insets;
    covered[side] = Math.max(covered[side], depth[side]);
  }
  return { width: element.clientWidth, height: element.clientHeight, covered };
}

/** Return the options of an animation of `ms`; it has no duration if the person prefers no motion. */
function glide(ms: number): { duration: number; interpolate: "linear" } {
  const still = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  // A straight way: a flight that zooms out in between would show other cards.
  return { duration: still ? 0 : ms, interpolate: "linear" };
}

/** Elements in which people type, decide, or navigate by keys. */
const BUSY =
  "input, textarea, select, [contenteditable=true], [role=dialog] *, [role=treegrid], [role=treegrid] *";

/**
 * Focuses a card that may be rendered some frames later; gives up if the person focuses something
 * else meanwhile.
 */
export function focusCard(room: HTMLElement, key: Key, tries: number): void {
  const before = document.activeElement;
  const look = (left: number) => {
    // The element that has the focus now, such as the search field, may be about to close.
    const now = document.activeElement;
    if (now !== before && now?.matches(BUSY)) return;
    const card = room.querySelector<HTMLElement>(`.react-flow__node[data-id="${CSS.escape(key)}"]`);
    if (card !== null) card.focus({ preventScroll: true });
    else if (left > 0) requestAnimationFrame(() => look(left - 1));
  };
  look(tries);
}

/** Return the functions that move the view, and how it follows the run. */
export function useViewport(given: ViewportInput) {
  const { flow, frame, places, sizes, lines, direction, phone, progress, run, pointer } = given;
  const { blockOf, unfoldRound, toView } = given;
  const [begun, empty] = [given.opens === "cards", given.opens === "ends"];
  const now = useRef({ places, sizes, direction });
  now.current = { places, sizes, direction };
  const least = phone ? READABLE.phone : READABLE.desktop;

  const viewOf = useCallback(
    (goal: Goal): Viewport | null => {
      const { places, sizes, direction } = now.current;
      const pill = pillSize(direction);
      const all: Sizes = new Map([[ENTRY, pill], [EXIT, pill], ...sizes]);
      const [box, element] = [boundsOf(places, all, lines.points()), frame.current];
      if (box === null || element === null) return null;
      const room = roomOf(element);
      if (goal === "whole") return wholeViewport(box, room);
      const [x, y] = places.get(ENTRY) ?? [box.x, box.y];
      const { width, height } = all.get(ENTRY) ?? pill;
      return firstViewport(box, room, [x + width / 2, y + height / 2], least, direction);
    },
    [frame, lines, least],
  );
  // A fitted view is fitted again when the canvas changes its size, until somebody moves the view.
  const fitted = useRef<{ view: Viewport; goal: Goal } | null>(null);
  const showAll = useCallback(
    (goal: Goal, duration: number) => {
      const go = (view: Viewport) => {
        fitted.current = { view, goal };
        return flow.setViewport(view, glide(duration));
      };
      const first = viewOf(goal);
      if (first === null) return;
      const shown = go(first);
      const mine = fitted.current;
      // Lines round cards are known later than the cards, and take room, too.
      void Promise.all([shown, lines.whenRouted()]).then(() => {
        const isStill = mine === fitted.current && isSameViewport(first, flow.getViewport());
        const next = isStill ? viewOf(goal) : null;
        if (next !== null && !isSameViewport(first, next)) void go(next);
      });
    },
    [flow, lines, viewOf],
  );

  // The graph arrives after the canvas, and its sizes later still; a Fit that was pressed meanwhile
  // is remembered.
  const opened = useRef(false);
  const asked = useRef<Goal>("first");
  // By sizes that are expected: else cards are drawn that nobody sees then, and these only later.
  useLayoutEffect(() => {
    const view = begun && !opened.current ? viewOf(asked.current) : null;
    if (view !== null) void flow.setViewport(view);
  }, [begun, flow, viewOf]);
  useEffect(() => {
    if (!begun || opened.current) return;
    const timer = setTimeout(() => {
      opened.current = true;
      showAll(asked.current, 0);
    }, 60);
    return () => clearTimeout(timer);
  }, [begun, showAll]);
  // The two ends of an empty graph would else start below the bar. The first card opens the graph
  // as usual.
  useEffect(() => {
    if (!empty || opened.current) return;
    const timer = setTimeout(() => {
      showAll("first", 0);
      const { view } = fitted.current ?? { view: flow.getViewport() };
      // The ends stand above the hint in the middle of an empty graph.
      void flow.setViewport({ ...view, y: view.y - (frame.current?.clientHeight ?? 0) / 4 });
      fitted.current = null;
    }, 60);
    return () => clearTimeout(timer);
  }, [empty, showAll, flow, frame]);

  useEffect(() => {
    const room = frame.current;
    if (room === null) return;
    const details = () => room.closest("main")?.dataset.details;
    let before = details();
    const watch = new ResizeObserver(() => {
      const last = fitted.current;
      const same = before === details();
      before = details();
      // When the details open by a click, the canvas stays as it is under the pointer.
      if (!same) return;
      if (last && isSameViewport(last.view, flow.getViewport())) showAll(last.goal, 0);
    });
    watch.observe(room);
    return () => watch.disconnect();
  }, [flow, frame, showAll]);

  const show = useCallback(
    (keys: readonly Key[], goal: "near" | "middle" | "whole") => {
      const some: Positions = new Map();
      for (const key of keys) {
        const at = now.current.places.get(key);
        if (at) some.set(key, at);
      }
      const [box, room] = [boundsOf(some, now.current.sizes), frame.current];
      if (box === null || room === null) return;
      fitted.current = null;
      const size = roomOf(room);
      const here: Viewport = flow.getViewport();
      if (goal === "whole") {
        void flow.setViewport(wholeViewport(box, size), glide(250));
        return;
      }
      const zoom = goal === "middle" ? Math.max(here.zoom, least) : here.zoom;
      const next = fitsAt(box, size, zoom)
        ? (viewportShowing(box, size, { ...here, zoom }) ??
          (zoom === here.zoom ? null : { ...here, zoom }))
        : goal === "middle"
          ? wholeViewport(box, size)
          : null;
      if (next !== null) void flow.setViewport(next, glide(250));
    },
    [flow, frame, least],
  );

  const showWhole = useCallback(() => showAll("whole", 300), [showAll]);
  const follow = useFollowRun({
    ...{ flow, frame, now, run, progress, blockOf, glide },
    ...{ aside: given.aside, onEnd: showWhole },
  });
  const { onChosen } = follow;
  const view = useMemo<CanvasView>(
    () => ({
      fit: () => {
        asked.current = "whole";
        showAll("whole", 200);
      },
      open: () => showAll("first", 200),
      reopen: () => {
        if (fitted.current !== null) showAll(fitted.current.goal, 200);
      },
      zoomIn: () => {
        fitted.current = null;
        onChosen();
        void flow.zoomIn(glide(120));
      },
      zoomOut: () => {
        fitted.current = null;
        onChosen();
        void flow.zoomOut(glide(120));
      },
      show: (keys, goal = "middle") => {
        onChosen();
        unfoldRound(keys);
        show(keys, goal);
      },
      reveal: (at) => {
        const room = frame.current;
        if (room === null) return;
        const [x, y] = toView(at);
        const size = roomOf(room);
        const next = viewportShowing({ x, y, ...CARD }, size, flow.getViewport());
        fitted.current = null;
        if (next !== null) void flow.setViewport(next, glide(200));
      },
      middle: (): Position => {
        const box = frame.current?.getBoundingClientRect();
        // Leaves room for what follows at the right, or below.
        const [along, down] = now.current.direction === "right" ? [0.3, 0.4] : [0.5, 1 / 3];
        const [x, y] = box ? [box.left + box.width * along, box.top + box.height * down] : [0, 0];
        const at = flow.screenToFlowPosition({ x, y });
        return [Math.round(at.x), Math.round(at.y)];
      },
      screenOf: ([x, y]): Position => {
        const at = flow.flowToScreenPosition({ x, y });
        return [at.x, at.y];
      },
      pointer: () => {
        const screen = pointer.current;
        if (screen === null) return null;
        const at = flow.screenToFlowPosition({ x: screen[0], y: screen[1] });
        return { screen, at: [Math.round(at.x), Math.round(at.y)] };
      },
      focus: (key) => {
        unfoldRound([key]);
        const room = frame.current;
        if (room !== null) focusCard(room, key, 12);
      },
    }),
    [showAll, show, flow, frame, pointer, unfoldRound, toView, onChosen],
  );

  const onPanned = useCallback(() => {
    fitted.current = null;
    follow.onPanned();
  }, [follow.onPanned]);
  return { view, lost: follow.lost, onFollow: follow.onFollow, onPanned };
}
