/** The drawer under the canvas: the run of the graph, once there was one. */

import { IconTimeline } from "@tabler/icons-react";
import { type KeyboardEvent, type PointerEvent, type ReactNode, useRef, useState } from "react";
import type { Run } from "../../api/runs";
import { useKept } from "../../ui/hooks";
import { keyOf } from "../../ui/keys";
import { boundedPart } from "../../ui/lazy-part";
import style from "./run-drawer.module.css";
import type { ShownRunProps } from "./shown-run";

/** Loaded while the page rests: graphs are opened to be drawn, too. */
const ShownRun = boundedPart(() => import("./shown-run").then((part) => part.ShownRun));

interface Props extends Omit<ShownRunProps, "run"> {
  /** Undefined until it is known. */
  run: Run | null | undefined;
}

export function RunDrawer(props: Props) {
  const { run, folded } = props;
  const low = folded === null ? "alone" : "low";
  if (run === undefined) return <DrawerFrame mode={low} busy />;
  if (run === null) {
    return (
      <DrawerFrame mode={low}>
        <div className={style.none}>
          <IconTimeline size={18} aria-hidden />
          <span>Not run yet. While the graph runs, every action appears here as a lane.</span>
        </div>
      </DrawerFrame>
    );
  }
  return (
    <DrawerFrame mode={folded === false ? "open" : low}>
      <ShownRun {...props} run={run} />
    </DrawerFrame>
  );
}

const LEAST = 96; // px: the head and two lanes
const MOST = 0.7; // of the window
const STEP = 24; // px by a key

/** A height that leaves the canvas something, whatever the window was when it was chosen. */
export function heldHeight(wanted: number, room: number): number {
  return Math.round(Math.min(Math.max(LEAST, wanted), Math.max(LEAST, room * MOST)));
}

/** Return the height of the drawer, px, before anybody pulled it: 302, or a quarter of a low screen (`room`). */
export function usualHeight(room: number): number {
  return heldHeight(Math.min(302, room * 0.27), room);
}

function useDrawerHeight() {
  const [kept, keep] = useKept<number | null>("aa.drawer-height", null);
  const [pulled, setPulled] = useState<number | null>(null);
  const room = window.innerHeight;
  const height = heldHeight(pulled ?? kept ?? usualHeight(room), room);
  return { height, room, setPulled, keep };
}

/** Pulled by a hand, or moved by the arrow keys. */
function Handle({ height, room, setPulled, keep }: ReturnType<typeof useDrawerHeight>) {
  const from = useRef<{ y: number; height: number } | null>(null);
  const onPointerDown = (event: PointerEvent<HTMLElement>) => {
    event.currentTarget.setPointerCapture(event.pointerId);
    from.current = { y: event.clientY, height };
  };
  const onPointerMove = (event: PointerEvent) => {
    const { current } = from;
    if (current !== null) setPulled(current.height + current.y - event.clientY);
  };
  const onPointerUp = () => {
    if (from.current !== null) keep(height);
    from.current = null;
    setPulled(null);
  };
  const onKeyDown = (event: KeyboardEvent) => {
    const by = { ArrowUp: STEP, ArrowDown: -STEP }[keyOf(event)] ?? 0;
    if (by === 0) return;
    event.preventDefault();
    event.stopPropagation();
    keep(heldHeight(height + by, room));
  };
  return (
    // biome-ignore lint/a11y/useSemanticElements: <hr> takes no focus
    <div
      role="separator"
      aria-orientation="horizontal"
      aria-label="Height of the run"
      aria-valuemin={LEAST}
      aria-valuemax={Math.round(room * MOST)}
      aria-valuenow={height}
      tabIndex={0}
      className={style.handle}
      onPointerDown={onPointerDown}
      onPointerMove={onPointerMove}
      onPointerUp={onPointerUp}
      onPointerCancel={onPointerUp}
      onDoubleClick={() => keep(null)}
      onKeyDown={onKeyDown}
    />
  );
}

interface DrawerFrameProps {
  /** `low`: its head only; `alone`: it has a place of its own and fills it. */
  mode: "open" | "low" | "alone";
  busy?: boolean;
  children?: ReactNode;
}

function DrawerFrame({ mode, busy = false, children }: DrawerFrameProps) {
  const pull = useDrawerHeight();
  return (
    <section
      className={style.drawer}
      data-mode={mode}
      aria-label="Run"
      aria-busy={busy || undefined}
      style={mode === "open" ? { height: pull.height } : undefined}
    >
      {mode === "open" && <Handle {...pull} />}
      {children}
    </section>
  );
}
