/**
 * Computes what the canvas draws: elements, places, sizes, drags of this person and of others, and
 * the selection.
 */
import {
  type EdgeChange,
  type NodeChange,
  type ReactFlowInstance,
  useReactFlow,
  useStoreApi,
} from "@xyflow/react";
import {
  type Dispatch,
  type MouseEvent as ReactMouseEvent,
  type SetStateAction,
  useCallback,
  useEffect,
  useLayoutEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import { checkedColor } from "../../api/people";
import { LineStore } from "../../canvas/arrows/line-store";
import {
  type EditorStore,
  type PlaceMap,
  useEditorStore,
  useSpread,
} from "../../canvas/editor-store";
import {
  type Arrow,
  type CanvasNode,
  type CardSurroundings,
  edgesOf,
  type Folding,
  keepEqual,
  nodesOf,
  sceneOf,
  surroundingsOf,
} from "../../canvas/elements";
import {
  foldedArrows,
  foldedNodes,
  foldedScene,
  foldingOf,
  wholeSizes,
} from "../../canvas/folding/folding";
import { positionsOf, unplaced } from "../../canvas/geometry/arrange";
import type { Positions } from "../../canvas/geometry/ranks";
import { arrowAt, pointOf } from "../../canvas/hit-test";
import type { ProblemMarks } from "../../canvas/marks/problem-marks";
import { notePlaces } from "../../canvas/notes/note-nodes";
import { asOneEdit, insertInto, moveActions, moveLoose } from "../../graph/edit";
import { type Note, notesOf, placeNotes, withContents } from "../../graph/edit/notes";
import type { Graph, Key, Position } from "../../graph/model";
import type { Progress } from "../../status/progress";
import type { Participant } from "../../sync/presence/presence";
import { usePeople, useRoom } from "../../sync/use-room";

export interface MeasuredSize {
  readonly width: number;
  readonly height: number;
}

/** The elements of the last drawing, whose unchanged parts keep their identity. */
interface Drawn {
  readonly nodes: CanvasNode[];
  readonly edges: Arrow[];
  readonly around: CardSurroundings | null;
}

interface CanvasElementsInput {
  graph: Graph;
  /** True before the graph has arrived: nothing stands on the canvas, not even entry and exit. */
  awaited: boolean;
  selection: ReadonlySet<string>;
  select: (ids: Iterable<string>) => void;
  progress: ReadonlyMap<Key, Progress>;
  marks: ProblemMarks;
  /** Places for elements without one, while the graph is being laid out. */
  laidOut: Positions | null;
  /** Keys of the folded frames. */
  folded: ReadonlySet<string>;
  /** Drags and selections of others are not shown: they belong to the graph of now, not to the past. */
  alone: boolean;
}

const NOBODY: readonly Participant[] = [];
const NO_NODES: CanvasNode[] = [];

/** Return the places of all elements, including the drags of others and of this person (`own`). */
export function dragged(
  places: Positions,
  people: readonly Participant[],
  own: Positions | null,
): Positions {
  const drags = people.flatMap((person) => person.presence.drag ?? []);
  if (drags.length === 0 && own === null) return places;
  const moved: Positions = new Map(places);
  for (const { ids, dx, dy } of drags) {
    for (const id of ids) {
      const at = places.get(id);
      if (at) moved.set(id, [at[0] + dx, at[1] + dy]);
    }
  }
  for (const [key, at] of own ?? []) moved.set(key, at);
  return moved;
}

const round = (n: number) => Math.round(n);

/** Return the selection after React Flow's changes. Arrows of one relation are selected together. */
export function selectionAfter(
  before: ReadonlySet<string>,
  changes: readonly (NodeChange | EdgeChange)[],
): ReadonlySet<string> {
  const next = new Set(before);
  const chosen: string[] = [];
  for (const change of changes) {
    if (change.type !== "select") continue;
    const id = change.id.split("|")[0] ?? change.id;
    if (change.selected) chosen.push(id);
    else next.delete(id);
  }
  for (const id of chosen) next.add(id);
  const same = next.size === before.size && [...next].every((id) => before.has(id));
  return same ? before : next;
}

/** Return the colours of the people who have selected elements, by key. */
function useChosenByOthers(people: readonly Participant[]): ReadonlyMap<string, string> {
  return useMemo(
    () =>
      new Map(
        people.flatMap(({ color, presence }) =>
          presence.selection.map((key) => [key, checkedColor(color)] as const),
        ),
      ),
    [people],
  );
}

/** Return nodes and edges; unchanged elements keep their identity. */
function useDrawn(graph: Graph, options: Parameters<typeof nodesOf>[1], folding: Folding | null) {
  const { selected, progress, marks } = options;
  const drawn = useRef<Drawn>({ nodes: [], edges: [], around: null });
  const nodes = useMemo(() => {
    const before = drawn.current.nodes;
    return keepEqual(before, foldedNodes(nodesOf(graph, options, before), folding, graph, options));
  }, [graph, options, folding]);
  const around = useMemo(() => surroundingsOf(graph, drawn.current.around), [graph]);
  const { relations } = graph;
  const edges = useMemo(() => {
    const all = edgesOf({ relations }, { selected, progress, marks }, around);
    return keepEqual(drawn.current.edges, foldedArrows(all, folding));
  }, [relations, selected, progress, marks, around, folding]);
  useEffect(() => {
    drawn.current = { nodes, edges, around };
  }, [nodes, edges, around]);
  return { nodes, edges };
}

/** Keep the lines of the arrows up to date with everything that stands on the canvas. */
function useLines(
  graph: Graph,
  { places, measured, marks, rest }: Parameters<typeof sceneOf>[1],
  folding: Folding | null,
) {
  const [lines] = useState(() => new LineStore());
  useLayoutEffect(() => {
    const whole = sceneOf(graph, { places, measured, marks, rest }, lines.offset);
    lines.show(foldedScene(whole, folding, places));
  }, [lines, graph, places, measured, marks, rest, folding]);
  useEffect(() => () => lines.close(), [lines]);
  return lines;
}

/** Return a function that applies React Flow's changes to the selection. */
function useSelectionChanges(
  selection: ReadonlySet<string>,
  select: CanvasElementsInput["select"],
): (changes: readonly (NodeChange | EdgeChange)[]) => void {
  const chosen = useRef(selection);
  chosen.current = selection;
  return useCallback(
    (changes) => {
      const after = selectionAfter(chosen.current, changes);
      if (after !== chosen.current) {
        chosen.current = after;
        select(after);
      }
    },
    [select],
  );
}

interface Placed {
  readonly graph: Graph;
  /** Places as they are while nothing is dragged. */
  readonly rest: Positions;
  readonly sizes: ReadonlyMap<Key, MeasuredSize>;
  readonly folding: Folding | null;
  /** Maps a place in the drawing to its place in the document. */
  readonly toDocument: PlaceMap;
}

/** Return the place in the document, in whole px, of a card that React Flow has drawn at a place. */
function standing({ toDocument }: Pick<Placed, "toDocument">, at: { x: number; y: number }) {
  const [x, y] = toDocument([at.x, at.y]);
  return [round(x), round(y)] as const;
}

/** Return the places after elements were dragged; frames take their contents along. */
function afterMoves(
  before: Positions | null,
  moves: readonly NodeChange<CanvasNode>[],
  placed: Placed,
): Positions {
  const { graph, rest, sizes } = placed;
  const next: Positions = new Map(before);
  for (const move of moves) {
    if (move.type !== "position" || !move.position) continue;
    next.set(move.id, standing(placed, move.position));
  }
  const own = new Map(
    moves.flatMap((move): [string, Position][] => {
      const at = move.type === "position" ? next.get(move.id) : undefined;
      return move.type === "position" && at ? [[move.id, at]] : [];
    }),
  );
  for (const [key, at] of withContents(graph, own, rest, sizes)) next.set(key, at);
  return next;
}

/** Return the measured sizes; an expanded card keeps its former size, which it has in the document. */
function afterSizes(
  before: Placed["sizes"],
  sized: readonly NodeChange<CanvasNode>[],
  onCards: EditorStore["expanded"],
) {
  const expanded = onCards.now()?.sizes;
  const next = new Map(before);
  for (const change of sized)
    if (change.type === "dimensions" && change.dimensions && !expanded?.has(change.id))
      next.set(change.id, change.dimensions);
  return next;
}

/** Return a function that takes React Flow's changes of sizes, places and selection. */
function useNodeChanges(
  placed: Placed,
  setSizes: Dispatch<SetStateAction<ReadonlyMap<Key, MeasuredSize>>>,
  setDrag: Dispatch<SetStateAction<Positions | null>>,
  takeSelection: ReturnType<typeof useSelectionChanges>,
) {
  const store = useStoreApi();
  const { expanded } = useEditorStore();
  const now = useRef(placed);
  now.current = placed;
  // A marquee within a frame selects its contents, not the frame, unless the frame is folded.
  const isNoFrame = useCallback((change: NodeChange<CanvasNode>) => {
    if (change.type !== "select" || !change.selected) return true;
    if (now.current.folding?.blocks.has(change.id)) return true;
    const note = notesOf(now.current.graph).find(({ key }) => key === change.id);
    return note?.kind !== "frame";
  }, []);
  return useCallback(
    (all: NodeChange<CanvasNode>[]) => {
      const changes = store.getState().userSelectionActive ? all.filter(isNoFrame) : all;
      const sized = changes.filter((change) => change.type === "dimensions");
      if (sized.length > 0) setSizes((before) => afterSizes(before, sized, expanded));
      const moves = changes.filter((change) => change.type === "position" && change.dragging);
      if (moves.length > 0) {
        const { current } = now;
        setDrag((before) => afterMoves(before, moves, current));
      }
      takeSelection(changes);
    },
    [store, expanded, isNoFrame, setSizes, setDrag, takeSelection],
  );
}

/** Return the handlers that tell others about a drag, and that write the new places when it ends. */
function useDragging(
  placed: Placed,
  over: string | null,
  setOver: (arrow: string | null) => void,
  setDrag: (drag: Positions | null) => void,
) {
  const { doc, presence } = useRoom();
  const { graph, rest, sizes } = placed;
  const begun = useRef<Position | null>(null);
  const onDrag = (
    event: MouseEvent | TouchEvent | ReactMouseEvent,
    node: CanvasNode,
    all: CanvasNode[],
  ) => {
    const at = standing(placed, node.position);
    begun.current ??= rest.get(node.id) ?? at;
    const [dx, dy] = [round(at[0] - begun.current[0]), round(at[1] - begun.current[1])];
    const moved = new Map(all.map(({ id, position }) => [id, standing(placed, position)]));
    const ids = [...withContents(graph, moved, rest, sizes).keys()];
    presence.tell({ drag: { ids, dx, dy } });
    setOver(insertable(graph, all) ? arrowAt(pointOf(event)) : null);
  };
  const onDragStop = (_: unknown, __: CanvasNode, all: CanvasNode[]) => {
    const moved = new Map(all.map(({ id, position }) => [id, standing(placed, position)] as const));
    if (begun.current !== null) {
      const dropped = withContents(graph, moved, rest, sizes);
      asOneEdit(doc, () => {
        moveLoose(doc, graph.direction, unplaced(graph, rest));
        moveActions(doc, dropped);
        placeNotes(doc, graph, dropped);
        const [only] = all;
        if (over !== null && only) insertInto(doc, over, only.id);
      });
    }
    begun.current = null;
    setDrag(null);
    setOver(null);
    presence.tell({ drag: undefined });
  };
  return { onDrag, onDragStop };
}

/**
 * Return what folded frames hide, and the sizes of all elements. Something dragged over a block
 * stays visible until it is dropped.
 */
function useFolding(
  graph: Graph,
  folded: ReadonlySet<string>,
  rest: Positions,
  sizes: Placed["sizes"],
) {
  const folding = useMemo(
    () => foldingOf(graph, folded, rest, sizes),
    [graph, folded, rest, sizes],
  );
  const known = useMemo(
    () => (folding === null ? sizes : wholeSizes(graph, sizes)),
    [folding, graph, sizes],
  );
  return { folding, known };
}

/** Return the elements of the canvas, their places and sizes, and the handlers of React Flow's changes. */
export function useCanvasElements(given: CanvasElementsInput) {
  const { graph, selection, select, progress, marks, laidOut, folded } = given;
  const here = usePeople();
  const people = given.alone ? NOBODY : here;
  const onScreen: ReactFlowInstance<CanvasNode, Arrow> = useReactFlow<CanvasNode, Arrow>();
  const [sizes, setSizes] = useState<ReadonlyMap<Key, MeasuredSize>>(new Map());
  const [drag, setDrag] = useState<Positions | null>(null);
  const [resized, setResized] = useState<Note | null>(null);
  const [over, setOver] = useState<string | null>(null);
  const rest = useMemo(
    () => new Map([...positionsOf(graph, sizes), ...(laidOut ?? []), ...notePlaces(graph)]),
    [graph, sizes, laidOut],
  );
  const { folding, known } = useFolding(graph, folded, rest, sizes);
  const spread = useSpread({ graph, rest, folding, flow: onScreen });
  const places = useMemo(() => dragged(rest, people, drag), [rest, people, drag]);
  const drawnPlaces = useMemo(() => spread.placesOf(places), [spread, places]);
  const drawnRest = useMemo(() => spread.placesOf(rest), [spread, rest]);
  const measured = useMemo(() => spread.sizesOf(sizes), [spread, sizes]);
  const { flow, toDocument, expanded } = spread;
  const others = useChosenByOthers(people);
  // The arrow that would take in the dragged action looks selected.
  const selected = useMemo(
    () => (over === null ? selection : new Set([...selection, over])),
    [selection, over],
  );
  const options = useMemo(
    () => ({ others, places: drawnPlaces, selected, progress, marks, measured, resized, expanded }),
    [others, drawnPlaces, selected, progress, marks, measured, resized, expanded],
  );
  const drawn = useDrawn(spread.graph, options, spread.folding);
  const lines = useLines(spread.graph, { ...options, rest: drawnRest }, spread.folding);
  const placed = { graph, rest, sizes: known, folding, toDocument };
  const onEdgesChange = useSelectionChanges(selection, select);
  const onNodesChange = useNodeChanges(placed, setSizes, setDrag, onEdgesChange);
  const handlers = { onNodesChange, onEdgesChange, ...useDragging(placed, over, setOver, setDrag) };
  const view = { ...spread, places: drawnPlaces, sizes: spread.sizesOf(known) };
  const stands = { folding, places, sizes: known };
  const elements = given.awaited ? { nodes: NO_NODES, edges: drawn.edges } : drawn;
  return { flow, lines, ...elements, ...stands, view, setResized, setOver, ...handlers };
}

/** Return whether the dragged elements are one action without arrows, which can be inserted into an arrow. */
function insertable(graph: Graph, dragged: readonly CanvasNode[]): boolean {
  const [only, ...others] = dragged;
  if (only?.type !== "action" || others.length > 0) return false;
  return !graph.relations.some(({ parent, child }) => parent === only.id || child === only.id);
}
