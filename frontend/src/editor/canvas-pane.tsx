/** The canvas with its tools and bars, and the hint on an empty canvas. */

import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconFocus2 } from "@tabler/icons-react";
import { ReactFlowProvider } from "@xyflow/react";
import { type ReactNode, useEffect, useMemo, useRef } from "react";
import { useSearch } from "wouter";
import { isUnplaced } from "../canvas/geometry/arrange";
import { ChangeMarked } from "../canvas/marks/change-marks";
import { NO_PROBLEM_MARKS, type ProblemMarks } from "../canvas/marks/problem-marks";
import { TopDownButton } from "../canvas/top-down";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import {
  asksForHistory,
  commentIn,
  present,
  targetOf,
  withPast,
} from "../edit-actions/graph-links";
import { shownKeys } from "../edit-actions/view";
import { rootOf } from "../graph/document-keys";
import { readThreads } from "../graph/edit/comments";
import { EMPTY_GRAPH, type Key, type Position } from "../graph/model";
import type { SeenPast } from "../history/past-bar";
import { RobotFilter } from "../outline/robot-filter";
import { FollowFrame } from "../people/people";
import { useFollowedView } from "../people/use-followed-view";
import type { Progress } from "../status/progress";
import { useGraph, useLinkPart } from "../sync/use-room";
import { focusField } from "../ui/focus-field";
import { AfterFirstView, boundedPart } from "../ui/lazy-part";
import { useWatched } from "../ui/watched";
import { EditableCanvas } from "./canvas/editable-canvas";
import { useCanvasElements } from "./canvas/use-canvas-elements";
import { useFirstLayout } from "./canvas/use-first-layout";
import { useUnfolding, useViewport } from "./canvas/use-viewport";
import style from "./canvas-pane.module.css";
import { Toolbar, ZoomTools } from "./menus/toolbar";
import { useFirstViewEnd } from "./panels/use-first-view-end";
import { type EditorState, usePortrait } from "./use-editor";
import type { Past } from "./use-past";

const PastBar = boundedPart(() => import("../history/past-bar").then((part) => part.PastBar));
const DraftBar = boundedPart(() => import("../drafts/draft-bar").then((part) => part.DraftBar), {
  waiting: null,
});
const DryRunBar = boundedPart(() => import("./dry-run/dry-run-bar").then((part) => part.DryRunBar));

const EmptyHint = boundedPart(() => import("./empty-hint").then((part) => part.EmptyHint), {
  waiting: null,
});

interface Props {
  me: string;
  canvasHandle: EditorState["canvasHandle"];
  progress: ReadonlyMap<Key, Progress>;
  marks: ProblemMarks;
  compact: boolean;
  phone: boolean;
  /** The id of the current run, which the view follows; null without one. */
  run: string | null;
  /** The button beside an open dry-run that turns it into a run. */
  record: ReactNode;
  /** The key of the note whose text is being edited. */
  writing: string | null;
  /** Content of the lower right corner. */
  corner: ReactNode;
  past: Past;
  /** Called when placing cards without a place starts and ends; that is an edit. */
  onPlacing: (placing: boolean) => void;
}

/** Shows placeholders while the graph loads, and a hint while it is empty. */
function EmptyCanvas({ waiting, context }: { waiting: boolean; context: EditorContext }) {
  if (waiting) {
    return (
      <div className={style.waiting} aria-busy="true">
        <Skeleton height={92} width={208} radius="lg" />
        <Skeleton height={92} width={208} radius="lg" />
      </div>
    );
  }
  if (context.graph.actions.length > 0 || context.past !== null) return null;
  return <EmptyHint context={context} />;
}

/** Shows the tools at the bottom left, the zoom at the right, and `children` above it. `phone`: there is room
 * for a few tools only. */
function PaneFoot(props: { phone: boolean; hidden: boolean; children: ReactNode }) {
  return (
    <div className={style.foot}>
      <div className={style.tools} data-covers="bottom" data-hidden={props.hidden || undefined}>
        <Toolbar words={!props.phone} />
      </div>
      <div className={style.corner}>
        {props.children}
        {!props.phone && <ZoomTools />}
      </div>
    </div>
  );
}

function Robots() {
  return (
    <div className={style.robots} data-covers="top">
      <RobotFilter />
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

function PaneInFlow(props: Props) {
  const { me, canvasHandle, compact, phone, writing, corner, past } = props;
  const seen = useWatched(past.drawn);
  const context = useDrawnContext(seen);
  const { graph } = context;
  const isTurnable = !isUnplaced(useGraph());
  const isDryRun = context.dryRun !== null || undefined;
  const isPast = context.past !== null || undefined;
  const { progress, marks, run } = isPast ? NOTHING_RUNS : props;
  const arrived = useLinkPart(({ seq }) => seq > 0);
  const first = useFirstLayout(context, arrived, phone, props.onPlacing);
  const { selection, select, folded } = context;
  const canvas = useCanvasElements({
    graph: first.pending ? EMPTY_GRAPH : context.graph,
    awaited: !arrived && context.graph.actions.length === 0,
    ...{ selection, select, folded, marks, alone: isPast === true },
    progress: context.dryRun?.sighting.progress ?? progress,
    laidOut: first.places,
  });
  const { flow, places, sizes, view: drawn } = canvas;
  const side = seen?.side ?? null;
  const frame = useRef<HTMLDivElement>(null);
  const pointer = useRef<Position | null>(null);
  const waiting = !arrived || (first.pending && context.graph.actions.length > 1);
  const begun = arrived && context.graph.actions.length > 0 && !first.pending;
  const { view, lost, onPanned, onFollow } = useViewport({
    frame,
    ...drawn,
    places: side?.placesWith(places) ?? drawn.places,
    lines: canvas.lines,
    ...useUnfolding(context, canvas),
    direction: graph.direction,
    phone,
    opens: begun ? "cards" : arrived && !first.pending ? "ends" : "nothing",
    progress: isDryRun ? NOTHING : progress,
    run: isDryRun ? null : run,
    aside: (isDryRun ?? isPast) === true,
    pointer,
  });
  const followed = useFollowedView({ flow, frame, view, onPanned });
  useEffect(() => {
    canvasHandle.current = { positions: () => places, sizes: () => sizes, view: followed.view };
  }, [canvasHandle, followed, places, sizes]);
  const endFollowing = () => {
    onPanned();
    followed.end();
  };
  useDryRunInView(context);
  useFirstViewEnd(!waiting);
  useGraphLink(context, begun);

  return (
    <div className="column">
      <AfterFirstView>
        <DraftBar id={context.id} />
      </AfterFirstView>
      <div className={style.sides} data-side={side !== null || undefined}>
        {side && <side.Canvas {...{ side, flow, onPanned: endFollowing }} />}
        <div
          className={style.stage}
          ref={frame}
          aria-busy={first.busy}
          data-dry={isDryRun}
          data-then={isPast}
        >
          <ChangeMarked marks={seen?.marks ?? null}>
            <EditableCanvas
              context={context}
              canvas={canvas}
              me={me}
              map={!compact && side === null && context.graph.actions.length > 3}
              onPanned={endFollowing}
              pointer={pointer}
              writing={writing}
            />
          </ChangeMarked>
          <EmptyCanvas waiting={waiting} context={context} />
          {!compact && <Robots />}
          <FollowFrame />
          <PaneFoot phone={phone || side !== null} hidden={phone && (isDryRun ?? isPast) === true}>
            {lost && <FollowRun onFollow={onFollow} />}
            {phone && isTurnable && !isDryRun && !isPast && <TopDownButton />}
            {!context.dryRun && corner}
          </PaneFoot>
        </div>
      </div>
      <PlaybackBar context={context} record={props.record} {...{ past }} />
    </div>
  );
}

const NOTHING: ReadonlyMap<Key, Progress> = new Map();
/** Replaces run and problems while the past is shown, which has neither. */
const NOTHING_RUNS = { progress: NOTHING, marks: NO_PROBLEM_MARKS, run: null };

/**
 * Return the context with the graph that the canvas draws. The canvas shows each change of others
 * at once; panels beside it follow later.
 */
function useDrawnContext(seen: SeenPast | null): EditorContext {
  const context = useEditorContext();
  const now = usePortrait(useGraph(), true);
  const graph = context.past === null ? now : (seen?.drawn ?? context.graph);
  return useMemo<EditorContext>(() => ({ ...context, graph }), [context, graph]);
}

interface PlaybackBarProps {
  context: EditorContext;
  record: ReactNode;
  past: Past;
}

/** Shows the bar of the dry-run, or that of the moment of the past. */
function PlaybackBar({ context, record, past }: PlaybackBarProps) {
  const { dryRun, past: place } = context;
  if (dryRun) {
    return <DryRunBar context={{ ...context, dryRun }} run={dryRun} record={record} />;
  }
  if (place === null) return null;
  return (
    <PastBar
      drawn={place}
      wanted={past.wanted}
      show={past.show}
      side={past.side}
      onSide={past.setSide}
    />
  );
}

/** Brings an action into view when it starts in a dry-run. */
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
      <PaneInFlow {...props} />
    </ReactFlowProvider>
  );
}

const SETTLED = 160; // ms after which the canvas has measured its cards and shown the graph

/**
 * Selects and shows what the address points at, once the graph is there and whenever the address
 * changes. `begun`: the graph has arrived and has places.
 */
function useGraphLink(context: EditorContext, begun: boolean): void {
  // Moments of the past are in the address, too, and point at no element.
  const search = withPast(useSearch(), null);
  const now = useRef(context);
  now.current = context;
  useEffect(() => {
    if (begun && asksForHistory(search)) now.current.setPanel("history");
  }, [search, begun]);
  useEffect(() => {
    const asked = begun ? commentIn(search) : null;
    if (asked === null) return;
    const { doc, select, setPanel, view } = now.current;
    const thread = readThreads(rootOf(doc, "comments").entries()).find(({ id }) => id === asked);
    if (thread === undefined) {
      setPanel("comments");
      notifications.show({ message: "The comment is not there any more." });
      return;
    }
    const about = present(now.current.graph, [thread.about]);
    select(about);
    const timer = setTimeout(() => {
      if (about.length > 0) view.show(about);
      setPanel("comments"); // last: on a phone either the canvas or the panel is there
    }, SETTLED);
    return () => clearTimeout(timer);
  }, [search, begun]);
  useEffect(() => {
    const target = begun ? targetOf(search) : null;
    if (target === null) return;
    const timer = setTimeout(() => {
      const { graph, select, setPanel } = now.current;
      const selection = present(graph, target.selection);
      if (selection.length < target.selection.length) {
        notifications.show({
          message: "The link points to something that is no longer in this graph.",
        });
      }
      select(selection);
      if (target.problem !== null) setPanel(selection.length > 0 ? "details" : "problems");
      // The selection is rendered first; then its place is known.
      requestAnimationFrame(() => {
        const keys = shownKeys(now.current);
        if (keys.length > 0) now.current.view.show(keys);
        const [only] = selection;
        if (only !== undefined && target.field !== null) focusField(`${only}|${target.field}`);
      });
    }, SETTLED);
    return () => clearTimeout(timer);
  }, [search, begun]);
}
