/** The view of the canvas and other people: what is seen here is told, and somebody's can be followed. */
import { type ReactFlowInstance, useOnViewportChange, type Viewport } from "@xyflow/react";
import { type RefObject, useCallback, useEffect, useMemo, useSyncExternalStore } from "react";
import type { Arrow, CanvasNode } from "../canvas/elements";
import type { CanvasView as BenchView } from "../edit-actions/editor-context";
import type { SharedView } from "../sync/presence/presence";
import { useFollowing, useRoom } from "../sync/use-room";
import { keyOf } from "../ui/keys";

const GLIDE = 120; // ms; views come at most every 50 ms

/** Elements that use Esc themselves. */
const OWN_ESCAPE = "input, textarea, select, [role=dialog], [role=menu], [role=listbox]";

interface ViewSize {
  readonly width: number;
  readonly height: number;
}

/** Returns the part of the canvas that is seen through a frame of this size, to tell the others. */
export function viewOf({ x, y, zoom }: Viewport, { width, height }: ViewSize): SharedView {
  return {
    x: Math.round(-x / zoom),
    y: Math.round(-y / zoom),
    zoom: Math.round(zoom * 1000) / 1000,
    width: Math.round(width),
    height: Math.round(height),
  };
}

/** Returns the viewport in which a frame of this size shows all that the other person sees, with the same middle. */
export function viewportOnto(view: SharedView, { width, height }: ViewSize): Viewport {
  const theirs = { width: view.width ?? width, height: view.height ?? height };
  const zoom = view.zoom * Math.min(1, width / theirs.width, height / theirs.height);
  const middle = {
    x: view.x + theirs.width / view.zoom / 2,
    y: view.y + theirs.height / view.zoom / 2,
  };
  return { x: width / 2 - middle.x * zoom, y: height / 2 - middle.y * zoom, zoom };
}

interface FollowedViewInput {
  flow: ReactFlowInstance<CanvasNode, Arrow>;
  frame: RefObject<HTMLDivElement | null>;
  view: BenchView;
  /** Whatever else moves the view shall let it be. */
  onPanned: () => void;
}

/** Tells what is seen here, and follows. What the person does to the view ends that. */
export function useFollowedView({ flow, frame, view: own, onPanned }: FollowedViewInput) {
  const { presence, following } = useRoom();
  const { whom, follow } = useFollowing();
  const view = useSyncExternalStore(following.onChange, following.view);
  const sizeOf = useCallback((): ViewSize | null => {
    const room = frame.current;
    return room && { width: room.clientWidth, height: room.clientHeight };
  }, [frame]);
  const tell = useCallback(
    (viewport: Viewport) => {
      const size = sizeOf();
      // A follower passes on the view that they follow, so two who follow each other come to rest.
      const told = following.whom() === null ? size && viewOf(viewport, size) : following.view();
      if (told !== null) presence.tell({ view: told });
    },
    [presence, following, sizeOf],
  );
  useOnViewportChange({ onChange: tell });
  useEffect(() => {
    tell(flow.getViewport());
    return () => presence.tell({ view: undefined });
  }, [tell, flow, presence]);

  useEffect(() => {
    const size = sizeOf();
    if (view === null || size === null) return;
    presence.tell({ view });
    void flow.setViewport(viewportOnto(view, size), { duration: GLIDE });
  }, [view, flow, presence, sizeOf]);

  useEffect(() => {
    if (whom === null) return;
    onPanned();
    const onKey = (event: KeyboardEvent) => {
      if (keyOf(event) !== "Escape" || (event.target as Element | null)?.closest?.(OWN_ESCAPE))
        return;
      event.preventDefault(); // it has done its work
      follow(null);
    };
    window.addEventListener("keydown", onKey, true); // before the shortcuts, of which Esc is one
    return () => window.removeEventListener("keydown", onKey, true);
  }, [whom, follow, onPanned]);

  return useMemo(() => {
    const end = () => following.follow(null);
    const ending = (move: () => void) => () => {
      end();
      move();
    };
    const [fit, zoomIn, zoomOut] = [own.fit, own.zoomIn, own.zoomOut].map(ending);
    return { end, view: { ...own, fit, zoomIn, zoomOut } as BenchView };
  }, [following, own]);
}
