/**
 * State that the parts of one open graph share beside its document: canvas, menus, lists and panels.
 *
 * Each graph that is opened gets a store of its own, and its state ends with it. A part subscribes to the
 * values that it shows. State that outlives a graph stands elsewhere: STOP and unanswered starts
 * (`runs/`), drafts and kept texts (`ui/`), own shortcuts (`edit-actions/keys/`).
 */
import type { ReactFlowInstance } from "@xyflow/react";
import { type ComponentType, createContext, type ReactNode, use, useMemo, useState } from "react";
import type { Action, Graph, Key, Position, Precondition } from "../graph/model";
import type { ProblemGroup } from "../graph/problems/problem-groups";
import type { Progress } from "../status/progress";
import type { RunOnCanvas } from "../status/progress-inside";
import { useWatched, Watched } from "../ui/watched";
import type { Arrow, CanvasNode, Folding } from "./elements";
import type { Positions, Size, Sizes } from "./geometry/ranks";
import { BreakpointMark } from "./marks/breakpoint-mark";

export interface InsideSignProps {
  readonly of: Key;
  readonly name: string;
}

/** One action on the way to an inner graph. */
export interface InnerStep {
  readonly key: Key;
  readonly name: string;
}

/** The other graphs, for which actions of the open graph can stand. */
export interface GraphsInside {
  /** Names of all graphs by id. */
  readonly names: ReadonlyMap<string, string>;
  /** Ids of the other graphs by the name of the actions that stand for them. */
  readonly byName: ReadonlyMap<string, string>;
  /** True if actions with this graph's name stand for it, and not for an older graph of the same name. */
  readonly isNamed: boolean;
  /**
   * Opens the graph for which an action stands. `path`: keys of the expanded actions down to it,
   * joined by "/". If the action stands for no graph, the graph that contains it opens.
   */
  enter(path: string): void;
  /**
   * Opens an inner graph by the actions that lead to it, outermost first, and selects one of its
   * elements.
   */
  show(by: readonly InnerStep[], chosen: string | null): void;
  /** Expands graphs on the cards of their actions, without leaving the graph on the canvas. */
  readonly expand: {
    toggle(path: string): void;
    /** Expands one more level everywhere. */
    expandMore(): void;
    collapseAll(): void;
    isAnyExpanded(): boolean;
  };
  /** Returns to the action through which the person came; null if the graph was opened directly. */
  readonly leave: (() => void) | null;
  /** The component with the buttons that open and expand a graph, drawn on the card of its action. */
  readonly Sign: ComponentType<InsideSignProps>;
}

/** The graph for which an action stands, with the graphs that are expanded in it. */
export interface LevelGraph {
  /** The id of the graph on the server. */
  readonly id: string;
  /** Keys of the actions that lead here, outermost first, joined by "/". */
  readonly path: string;
  /** Names and numbers of these actions. */
  readonly names: readonly Pick<Action, "name" | "instanceId">[];
  /** Null while it is loading; a text tells why it cannot be loaded. */
  readonly graph: Graph | string | null;
  readonly levels: ReadonlyMap<Key, LevelGraph>;
}

export interface LevelFrameProps {
  readonly of: Key;
  readonly progress: Progress | null;
}

/** An action drawn on the card of another; its place is relative to the card's upper left corner. */
export interface PartOnCard extends Size {
  /** Keys of the actions that lead there, joined by "/". */
  readonly path: string;
  readonly x: number;
  readonly y: number;
  readonly action: Action;
  readonly progress: Progress | null;
  /** The graph that it stands for is itself expanded on it. */
  readonly expanded: boolean;
}

/** Maps a place in the document to its place in the drawing, or back. */
export type PlaceMap = (at: Position) => Position;

type Flow = ReactFlowInstance<CanvasNode, Arrow>;

/** A graph with the places of the document. */
export interface StandingGraph {
  readonly graph: Graph;
  /** Places as they are while nothing is dragged. */
  readonly rest: Positions;
  readonly folding: Folding | null;
  readonly flow: Flow;
}

/** A graph as it is drawn, with room for expanded cards; the document does not change. */
export interface Spread {
  /** The graph with its waypoints and frames as they are drawn. */
  readonly graph: Graph;
  readonly folding: Folding | null;
  /** Sizes of the expanded cards. */
  readonly expanded: Sizes | undefined;
  /** A React Flow instance that converts between places on screen and places in the document. */
  readonly flow: Flow;
  readonly toView: PlaceMap;
  readonly toDocument: PlaceMap;
  /** Returns the drawn places of elements with these places in the document. */
  placesOf(places: Positions): Positions;
  sizesOf(sizes: Sizes): Sizes;
}

/** The graphs that are expanded on the cards of their actions. */
export interface ExpandedGraphs {
  /** The expanded graphs by the actions of the graph on the canvas. */
  readonly levels: ReadonlyMap<Key, LevelGraph>;
  readonly sizes: Sizes;
  /** The component that draws the expanded graph. */
  readonly Frame: ComponentType<LevelFrameProps>;
  /** Returns the actions drawn on a card in their current states. */
  partsOf(key: Key): readonly PartOnCard[];
  /** Makes room for the expanded cards; null if nothing is drawn differently. */
  spread(standing: StandingGraph): Spread | null;
}

export interface SinceMark {
  readonly change: "added" | "changed";
  /** The difference in words, such as `speed 0.4 → 0.9`; empty for what was added. */
  readonly words: string;
  /** Names of the changed fields, as the history has them. */
  readonly fields: readonly string[];
}

/** Marks on cards and arrows that have changed since a run last went well. */
export interface SinceMarks {
  readonly graph: string;
  readonly run: number;
  /** The moment (`seq`) at which that run was started. */
  readonly seq: number;
  /** Marks by action key or relation id. Equal marks keep their identity. */
  readonly marks: ReadonlyMap<string, SinceMark>;
  /** The component that draws a mark; it is loaded together with the marks. */
  readonly Sign: ComponentType<SinceSignProps>;
}

export interface SinceSignProps {
  readonly of: string;
  readonly on: "card" | "arrow";
  readonly mark: SinceMark;
  readonly since: SinceMarks;
}

/** Outcomes of arrows that no expected course takes, by relation, and actions that it never visits. */
export interface UntakenPlaces {
  readonly outcomes: ReadonlyMap<string, readonly Precondition[]>;
  readonly actions: ReadonlySet<Key>;
}

/** The actions that give a value, and the actions that take it. */
interface TouchedActions {
  readonly producers: ReadonlySet<Key>;
  readonly consumers: ReadonlySet<Key>;
}

export class EditorStore {
  /** Null until the other graphs are known. The folder `levels`, which is loaded late, fills it. */
  readonly graphsInside = new Watched<GraphsInside | null>(null);
  /** Null while nothing is expanded. */
  readonly expanded = new Watched<ExpandedGraphs | null>(null);
  /** Problems of the graph on the canvas, including those of its inner graphs. */
  readonly problems = new Watched<readonly ProblemGroup[]>([]);
  /** The run whose states are on the canvas; null without one. */
  readonly run = new Watched<RunOnCanvas | null>(null);
  /** Null while nothing is marked. */
  readonly sinceMarks = new Watched<SinceMarks | null>(null);
  /** The robot whose actions are highlighted; empty for those of any robot, null for all actions. */
  readonly robot = new Watched<string | null>(null);
  /** The number of open comment threads by action. */
  readonly openThreads = new Watched<ReadonlyMap<Key, number>>(new Map());
  /** Null while coverage by expected courses is not shown. */
  readonly untaken = new Watched<UntakenPlaces | null>(null);
  /** Places where the run on the canvas waits, or where a led run would: words by action key or relation id. */
  readonly breakpoints = new Watched<ReadonlyMap<string, string>>(new Map());
  /** The actions that the focused parameter connects; null while no parameter is focused. */
  readonly touched = new Watched<TouchedActions | null>(null);
}

/** Canvases that only show a graph have no editor around them; nothing sets the state of this store. */
const EditorStoreContext = createContext(new EditorStore());

/** Provides the state of one open graph. `store`: for tests that look into it. */
export function EditorStoreProvider(props: { store?: EditorStore; children: ReactNode }) {
  const [store] = useState(() => props.store ?? new EditorStore());
  return <EditorStoreContext value={store}>{props.children}</EditorStoreContext>;
}

export function useEditorStore(): EditorStore {
  return use(EditorStoreContext);
}

/** Draws the buttons of an action that stands for a graph, once they are loaded. */
export function InsideSpot({ of, name }: InsideSignProps) {
  const Sign = useWatched(useEditorStore().graphsInside, (inside) =>
    inside?.byName.has(name) ? inside.Sign : undefined,
  );
  return Sign && <Sign of={of} name={name} />;
}

/** Shows the name of a graph. */
export function NameOfGraph({ id }: { id: string }) {
  return useWatched(useEditorStore().graphsInside, (inside) => inside?.names.get(id)) ?? "…";
}

/** Return the size of an expanded card and the component that draws its graph; null if it is not expanded. */
export function useExpandedCard(key: Key): { size: Size; Frame: ExpandedGraphs["Frame"] } | null {
  const { expanded } = useEditorStore();
  const size = useWatched(expanded, (now) => now?.sizes.get(key));
  const Frame = expanded.now()?.Frame;
  return size && Frame ? { size, Frame } : null;
}

const same = <T,>(as: T): T => as;
const AS_IT_STANDS = {
  ...{ expanded: undefined, toView: same, toDocument: same, placesOf: same, sizesOf: same },
};

/** Return the graph as it is drawn; without expanded cards that is the graph itself. */
export function useSpread({ graph, rest, folding, flow }: StandingGraph): Spread {
  const spread = useWatched(useEditorStore().expanded, (now) => now?.spread);
  return useMemo(
    () => spread?.({ graph, rest, folding, flow }) ?? { ...AS_IT_STANDS, graph, folding, flow },
    [spread, graph, rest, folding, flow],
  );
}

/** Draws the mark of an action or arrow that changed since the last good run, if it has one. */
export function SinceSpot({ of, on }: Pick<SinceSignProps, "of" | "on">) {
  const { sinceMarks } = useEditorStore();
  const mark = useWatched(sinceMarks, (now) => now?.marks.get(of));
  const since = sinceMarks.now();
  return mark && since && <since.Sign {...{ of, on, mark, since }} />;
}

/** Return whether a robot's actions are dimmed, since another robot is highlighted. */
export function useIsDimmed(robot: string): boolean {
  return useWatched(useEditorStore().robot, (lit) => lit !== null && lit !== robot);
}

/** Return whether an action gives or takes the value of the focused parameter. */
export function useDataRole(key: Key): "gives" | "takes" | undefined {
  return useWatched(useEditorStore().touched, (touched) => {
    if (touched?.producers.has(key)) return "gives";
    return touched?.consumers.has(key) ? "takes" : undefined;
  });
}

/** Return the number of open comment threads about an action. */
export function useOpenThreadCount(key: Key): number {
  return useWatched(useEditorStore().openThreads, (threads) => threads.get(key) ?? 0);
}

/** Draws the mark of the breakpoint of an action or arrow, if it has one. */
export function BreakpointSpot({ of, on }: { of: string; on: "card" | "arrow" }) {
  const words = useWatched(useEditorStore().breakpoints, (now) => now.get(of));
  return words !== undefined && <BreakpointMark {...{ of, on, words }} />;
}

const NONE: readonly Precondition[] = [];

/** Return the outcomes of a relation that no expected course takes; empty while coverage is not shown. */
export function useUntakenOutcomes(relation: string): readonly Precondition[] {
  return useWatched(useEditorStore().untaken, (now) => now?.outcomes.get(relation) ?? NONE);
}

/** Return whether no expected course visits an action; false while coverage is not shown. */
export function useIsUnvisited(key: Key): boolean {
  return useWatched(useEditorStore().untaken, (now) => now?.actions.has(key) ?? false);
}
