/** The canvas with its tools, and what it says while it is empty. */
import { Button, Kbd, Skeleton } from "@mantine/core";
import { IconFocus2, IconRouteAltLeft } from "@tabler/icons-react";
import { ReactFlowProvider } from "@xyflow/react";
import { type ReactNode, useEffect, useMemo, useRef } from "react";
import type { ProblemMarks } from "../canvas/problem-marks";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { EMPTY_GRAPH, type Key, type Position } from "../graph/model";
import { RobotFilter } from "../outline/robot-filter";
import { FollowFrame } from "../people/people";
import { useFollowedView } from "../people/use-followed-view";
import type { Progress } from "../status/progress";
import { useGraph, useLinkPart } from "../sync/use-room";
import { Empty } from "../ui/empty";
import { useHasFingersOnly } from "../ui/hooks/use-screen-size";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";
import { EditableCanvas } from "./canvas/editable-canvas";
import { useCanvasElements } from "./canvas/use-canvas-elements";
import { useFirstLayout } from "./canvas/use-first-layout";
import { useUnfolding } from "./canvas/use-unfolding";
import { useViewport } from "./canvas/use-viewport";
import style from "./canvas-pane.module.css";
import { Toolbar } from "./menus/toolbar";
import type { EditorState } from "./use-editor";
import { useGraphLink } from "./use-graph-link";

const DryRunBar = lazyPart(() => import("./dry-run/dry-run-bar").then((part) => part.DryRunBar));

interface Props {
  me: string;
  canvasHandle: EditorState["canvasHandle"];
  progress: ReadonlyMap<Key, Progress>;
  marks: ProblemMarks;
  compact: boolean;
  phone: boolean;
  /** The run that goes, if one does: the view follows it. */
  run: string | null;
  /** Beside the dry-run, if one is open: how it becomes a run. */
  record: ReactNode;
  /** The note whose text is being written. */
  writing: string | null;
  /** In the lower right corner. */
  corner: ReactNode;
  /** Whether cards that stand nowhere are about to be placed, which is an edit. */
  onPlacing: (placing: boolean) => void;
}

/** What is said while there is nothing to see. */
function Emptiness({ waiting, context }: { waiting: boolean; context: EditorContext }) {
  const fingers = useHasFingersOnly();
  if (waiting) {
    return (
      <div className={style.waiting} aria-busy="true">
        <Skeleton height={92} width={208} radius="lg" />
        <Skeleton height={92} width={208} radius="lg" />
      </div>
    );
  }
  if (context.graph.actions.length > 0) return null;
  if (!context.mayEdit) {
    return (
      <div className={style.empty}>
        <Empty icon={<IconRouteAltLeft size={22} />} title="Nothing is drawn yet">
          What the others draw appears here. You are here to look.
        </Empty>
      </div>
    );
  }
  return (
    <div className={style.empty}>
      <Empty
        icon={<IconRouteAltLeft size={22} />}
        title="What shall be done first?"
        action={
          <Button variant="filled" onClick={() => context.openAdd()}>
            Add an action
          </Button>
        }
      >
        {fingers
          ? "Tap Add, type a name. Then tap an outcome of its card and what follows."
          : "Double-click the canvas, or drag an action from the list. Then drag from its outcomes to what follows."}
        {!fingers && (
          <>
            {" "}
            By keyboard: <Kbd>A</Kbd> adds, <Kbd>C</Kbd> draws an arrow.
          </>
        )}
      </Empty>
    </div>
  );
}

function FollowRun({ onFollow }: { onFollow: () => void }) {
  return (
    <Button size="compact-sm" leftSection={<IconFocus2 size={15} />} onClick={onFollow}>
      Follow the run
    </Button>
  );
}

function Inside(props: Props) {
  const { me, canvasHandle, progress, marks, compact, phone, run, writing, record, corner } = props;
  const calm = useEditorContext();
  const graph = useGraph();
  // The canvas keeps up with the hands of others; what stands beside it comes after.
  const context = useMemo<EditorContext>(() => ({ ...calm, graph }), [calm, graph]);
  const arrived = useLinkPart(({ seq }) => seq > 0);
  const first = useFirstLayout(context, arrived, props.onPlacing);
  const { selection, select, folded } = context;
  const canvas = useCanvasElements({
    graph: first.pending ? EMPTY_GRAPH : context.graph,
    ...{ selection, select, folded, marks },
    progress: context.dryRun?.sighting.progress ?? progress,
    laidOut: first.places,
  });
  const { flow, places, sizes } = canvas;
  const frame = useRef<HTMLDivElement>(null);
  const pointer = useRef<Position | null>(null);
  const waiting = !arrived || (first.pending && context.graph.actions.length > 1);
  const begun = arrived && context.graph.actions.length > 0 && !first.pending;
  const dry = context.dryRun !== null || undefined;
  const { view, lost, onPanned, onFollow } = useViewport({
    flow,
    frame,
    places,
    sizes,
    lines: canvas.lines,
    ...useUnfolding(context, canvas),
    direction: graph.direction,
    phone,
    opens: begun ? "cards" : arrived && !first.pending ? "ends" : "nothing",
    progress: dry ? NOTHING : progress,
    run: dry ? null : run,
    pointer,
  });
  const followed = useFollowedView({ flow, frame, view, onPanned });
  useEffect(() => {
    canvasHandle.current = { positions: () => places, sizes: () => sizes, view: followed.view };
  }, [canvasHandle, followed, places, sizes]);

  useDryRunInView(context);
  useGraphLink(context, begun);

  return (
    <div className={style.whole}>
      <div className={style.stage} ref={frame} aria-busy={first.busy} data-dry={dry}>
        <EditableCanvas
          context={context}
          canvas={canvas}
          me={me}
          map={!compact && context.graph.actions.length > 3}
          onPanned={() => {
            onPanned();
            followed.end();
          }}
          pointer={pointer}
          writing={writing}
        />
        <Emptiness waiting={waiting} context={context} />
        {!compact && (
          <div className={style.robots} data-covers="top">
            <RobotFilter />
          </div>
        )}
        <FollowFrame />
        <div
          className={style.tools}
          data-covers="bottom"
          data-hidden={(phone && context.dryRun !== null) || undefined}
        >
          <Toolbar compact={compact} />
        </div>
        <div className={style.corner}>
          {lost && <FollowRun onFollow={onFollow} />}
          {!context.dryRun && corner}
        </div>
      </div>
      {context.dryRun && (
        <PartBoundary>
          <DryRunBar context={context} run={context.dryRun} record={record} />
        </PartBoundary>
      )}
    </div>
  );
}

const NOTHING: ReadonlyMap<Key, Progress> = new Map();

/** What begins to run in a dry-run comes into view. */
function useDryRunInView(context: EditorContext): void {
  const { dryRun, positions: places, view } = context;
  const keys = dryRun?.sighting.running.map(({ key }) => key).join(" ") ?? "";
  // biome-ignore lint/correctness/useExhaustiveDependencies: only when other actions run
  useEffect(() => {
    const [first] = keys.split(" ");
    const at = first ? places().get(first) : undefined;
    if (at) view.reveal(at);
  }, [keys]);
}

export function CanvasPane(props: Props) {
  return (
    <ReactFlowProvider>
      <Inside {...props} />
    </ReactFlowProvider>
  );
}
