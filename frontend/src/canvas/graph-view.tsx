/** A read-only canvas, as run pages and comparisons show it. */
import { Background, BackgroundVariant, ReactFlow, type Viewport } from "@xyflow/react";
import { type ReactNode, useEffect, useMemo, useState } from "react";
import type { Graph, Key, Position } from "../graph/model";
import { robotNames } from "../graph/robots";
import type { Progress } from "../status/progress";
import { NAME_RANK, useNameColors } from "../ui/name-colors";
import { LineContext, LineStore } from "./arrows/line-store";
import { type Arrow, type CanvasNode, edgesOf, nodesOf, sceneOf, surroundingsOf } from "./elements";
import { useLaidOut } from "./geometry/layout";
import { arrowAt, nodeAt } from "./hit-test";
import { NO_PROBLEM_MARKS } from "./marks/problem-marks";
import { menuKeyTarget, useMenuPress } from "./menu-press";
import { edgeTypes, nodeTypes } from "./node-types";
import { notePlaces } from "./notes/note-nodes";
import { ArrowTips } from "./outcome-arrow";
import { ZoomDetail } from "./zoom-detail";

const NONE: ReadonlySet<string> = new Set();

interface Props {
  graph: Graph;
  progress: ReadonlyMap<Key, Progress>;
  selected?: ReadonlySet<string>;
  /** The outcome of each action in the run that is compared with this one. */
  ghosts?: ReadonlyMap<Key, string>;
  label: string;
  onSelect?: (key: Key | null) => void;
  /** Called with the id of a relation; without it arrows cannot be chosen. */
  onSelectArrow?: ((id: string) => void) | undefined;
  /**
   * Called with the id of an action or relation whose menu is wanted, and the place for it. Returns
   * whether it has one: else a long press counts as a click.
   */
  onMenu?: ((id: string, screen: Position) => boolean) | undefined;
  /** Distinguishes several canvases on one page. */
  id?: string;
  /** Another canvas moves its view, so it does not fit the graph by itself. */
  led?: boolean;
  /** Called when the person has moved the view. */
  onPanned?: (to: Viewport) => void;
  /** Further elements within the canvas. */
  children?: ReactNode;
}

const LARGE = 150; // cards; beyond this number, cards out of sight are not rendered in a view that is led

export function GraphView(props: Props) {
  const { graph, progress, selected = NONE, label, onSelect, led = false, onPanned } = props;
  const { onSelectArrow, ghosts } = props;
  useNameColors(NAME_RANK.actors, robotNames(graph.actions));
  const [measured, setMeasured] = useState<ReadonlyMap<Key, object>>(new Map());
  const laidOut = useLaidOut(graph);
  const places = useMemo(
    () => new Map([...(laidOut?.places ?? []), ...notePlaces(graph)]),
    [graph, laidOut],
  );
  const options = useMemo(
    () => ({ places, selected, progress, marks: NO_PROBLEM_MARKS, measured, ghosts }),
    [places, selected, progress, measured, ghosts],
  );
  const nodes = useMemo(() => nodesOf(graph, options), [graph, options]);
  const edges = useMemo(
    () => edgesOf(graph, options, surroundingsOf(graph, null)),
    [graph, options],
  );
  const { onMenu } = props;
  const press = useMenuPress((screen) => {
    const id = nodeAt(screen) ?? arrowAt(screen);
    return id !== null && (onMenu?.(id, screen) ?? false);
  });
  const [lines] = useState(() => new LineStore());
  useEffect(() => lines.show(sceneOf(graph, options, lines.offset)), [lines, graph, options]);
  useEffect(() => () => lines.close(), [lines]);
  // The view fits the graph once, when it is first drawn: for a plain layout, and again for the
  // final one.
  if (laidOut === null) return <div aria-busy="true" aria-label={label} role="img" />;
  return (
    <LineContext value={lines}>
      <ReactFlow<CanvasNode, Arrow>
        key={laidOut.plain ? "plain" : "laid out"}
        {...(props.id === undefined ? {} : { id: props.id })}
        nodes={nodes}
        edges={edges}
        nodeTypes={nodeTypes}
        edgeTypes={edgeTypes}
        onNodesChange={(changes) => {
          // Chosen by a key; a click tells that by itself.
          const chosen = changes.find((each) => each.type === "select" && each.selected);
          if (chosen?.type === "select" && graph.actions.some(({ key }) => key === chosen.id))
            onSelect?.(chosen.id);
          const sized = changes.filter((change) => change.type === "dimensions");
          if (sized.length === 0) return;
          setMeasured((before) => {
            const next = new Map(before);
            for (const change of sized)
              if (change.dimensions) next.set(change.id, change.dimensions);
            return next;
          });
        }}
        onNodeClick={(_, node) => onSelect?.(node.type === "action" ? node.id : null)}
        onPaneClick={() => onSelect?.(null)}
        {...(onMenu && press)}
        onKeyDown={(event) => {
          const asked = onMenu && menuKeyTarget(event);
          if (!asked) return;
          event.preventDefault();
          onMenu(asked.id, asked.screen);
        }}
        nodesDraggable={false}
        nodesConnectable={false}
        panActivationKeyCode={null} // the space key plays the replay
        edgesFocusable={onSelectArrow !== undefined}
        onEdgeClick={(_, { data }) => data && onSelectArrow?.(data.relation)}
        onEdgesChange={(changes) => {
          const chosen = changes.find((each) => each.type === "select" && each.selected);
          const arrow = edges.find(({ id }) => chosen?.type === "select" && id === chosen.id);
          if (arrow?.data) onSelectArrow?.(arrow.data.relation);
        }}
        fitView={!led}
        onlyRenderVisibleElements={led && nodes.length > LARGE}
        // A move without an event was made by the page.
        onMove={(event, to) => event !== null && onPanned?.(to)}
        fitViewOptions={{ maxZoom: 1, padding: 0.12 }}
        minZoom={led ? 0.08 : 0.1}
        maxZoom={led ? 2.2 : 2}
        proOptions={{ hideAttribution: true }}
        aria-label={label}
      >
        <ArrowTips />
        <ZoomDetail />
        <Background variant={BackgroundVariant.Dots} gap={20} size={1.4} />
        {props.children}
      </ReactFlow>
    </LineContext>
  );
}
