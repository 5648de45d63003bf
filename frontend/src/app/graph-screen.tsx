/** The editor of a graph with the list on its left and its runs below. */

import {
  type ComponentProps,
  memo,
  type ReactNode,
  useEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import { Redirect, useSearch } from "wouter";
import { useVersions, versionName } from "../api/graphs";
import { type GraphAsAction, useGraphsAsActions } from "../api/library";
import { newestRun, openRuns } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMay, usePerson } from "../api/people";
import { type Run, useLastRun } from "../api/runs";
import { EditorStoreProvider, useEditorStore } from "../canvas/editor-store";
import { levelsOf } from "../canvas/level-path";
import { STATE_LETTER } from "../canvas/zoom-detail";
import { firstViewIsThere } from "../clock/first-view";
import { serverNow } from "../clock/server-clock";
import { scriptOf } from "../dry-run/script";
import { useSeed } from "../editor/dry-run/use-seed";
import { Editor, useEditorSummary } from "../editor/editor";
import { breakpointsIn } from "../graph/breakpoints";
import { READY_TEMPLATES } from "../graph/edit";
import { isReadyMade } from "../graph/questions";
import { robotNames } from "../graph/robots";
import { templatesOf, useKnownActions, usePlaceable } from "../home/known-actions";
import { askedDryRun, useReplay } from "../review/replay";
import { ConnectionStatus } from "../runs/connection-status";
import { RunDrawer } from "../runs/drawer/run-drawer";
import type { Waits } from "../runs/sent-graph";
import { StartControl, StartLook, useStartLook } from "../runs/start/start-control";
import { type Unsure, useRunStatus } from "../status/progress";
import { type GraphInRun, isInRun, useProgress } from "../status/progress-inside";
import { useUnsure } from "../status/silence";
import { roomUrl } from "../sync/room-connection";
import { RoomProvider, useLinkPart, useRoom, useThrottledGraph } from "../sync/use-room";
import { useStableCallback } from "../ui/hooks";
import { boundedPart, lazyPart } from "../ui/lazy-part";
import { NAME_RANK, useNameColors } from "../ui/name-colors";
import { instant } from "../ui/times";
import { useNewGraphs } from "./imports/new-graphs";
import { Nowhere, PageBar, PageFrame, useTitle } from "./page-frame";

/** Its column is there before, and the graph needs none of it. */
const Sidebar = boundedPart(() => import("../home/sidebar").then((part) => part.Sidebar), {
  waiting: null,
});
const DraftStatus = boundedPart(
  () => import("../runs/draft-status").then((part) => part.DraftStatus),
  { waiting: null },
);
const RunWaits = boundedPart(() => import("../runs/sent-graph").then((part) => part.RunWaits), {
  waiting: null,
});
const RunSteering = boundedPart(
  () => import("../runs/run-steering").then((part) => part.RunSteering),
  { waiting: null },
);
const BeginDialog = lazyPart(() =>
  import("../runs/start/begin-dialog").then((part) => part.BeginDialog),
);
const RecordDryRun = lazyPart(() =>
  import("../runs/start/record-dry-run").then((part) => part.RecordDryRun),
);

/** Longest wait of a start for the name of the moment on screen, ms. */
const NAMED_MS = 3_000;

function unnamed(): never {
  throw new Error("The editor did not say in time which moment is on screen. Nothing was started.");
}

interface RunHere {
  /** All that go on with this graph, on whatever robot. */
  going: readonly Run[];
  /** Shows another one of them, until a newer one begins. */
  choose: (run: string) => void;
  /** The run that is shown on the canvas: it goes on, or ended while this page was open. */
  live: Run | null;
  /** The newest run, also of last week: shown in the strip. Undefined until that is known. */
  run: Run | null | undefined;
  label: string;
  unsure: Unsure;
}

function useRunHere(id: string): RunHere {
  const { now, runner } = useLive();
  const [chosen, setChosen] = useState({ run: "", before: "" });
  const newest = newestRun(now, id);
  const going = openRuns(now).filter((run) => run.graph === id);
  const wanted = chosen.before === newest?.id ? now.runs.get(chosen.run) : undefined;
  const live = wanted ?? going[0] ?? newest;
  const last = useLastRun(runner, id).data;
  const run = live ?? last;
  const versions = useVersions(id, run?.version ?? null).data;
  const label = versionName(versions, run?.version ?? null) || run?.digest.slice(0, 7) || "";
  return {
    going,
    choose: (chosen) => setChosen({ run: chosen, before: newest?.id ?? "" }),
    live,
    run,
    label,
    unsure: useUnsure(live),
  };
}

const NO_GRAPHS: readonly GraphAsAction[] = [];

/** Through which graph one came first, and what those below it are called, down to this one. */
function useAround(): { outermost: string; names: readonly string[] } | null {
  const { name } = useThrottledGraph();
  const levels = useSearch();
  const { data: graphs = NO_GRAPHS } = useGraphsAsActions();
  return useMemo(() => {
    const [first, ...below] = levelsOf(levels);
    if (first === undefined) return null;
    const known = new Map(graphs.map((each) => [each.graph, each.name]));
    const names = [...below.map(({ graph }) => known.get(graph) ?? ""), name];
    return { outermost: first.graph, names };
  }, [levels, graphs, name]);
}

/** The run of this graph; or, for who came in through others, that of the outermost one, as far as this
 * graph is a part of it. A run that is this graph's own comes first while it is new. */
function useShownRun(id: string): RunHere & { inside: GraphInRun | null } {
  const graph = useThrottledGraph();
  const around = useAround();
  const own = useRunHere(id);
  const outer = useRunHere(around?.outermost ?? id);
  const names = around?.names;
  const inside = useMemo(() => names && { graph, names }, [graph, names]);
  const isPart = inside && outer.run && (outer.live || isInRun(outer.run, inside.names));
  return own.live === null && isPart ? { ...outer, inside } : { ...own, inside: null };
}

/** The right edge of what can be replayed: the end, or now. */
function useEdge(run: Run | null): number {
  return instant(run?.ended_at) ?? serverNow();
}

/** Tells what is drawn inside of actions which run is shown. */
function useRunOnCanvas(
  run: Run | null,
  unsure: Unsure,
  at: number | null,
  inside: GraphInRun | null,
): void {
  const names = inside !== null && "names" in inside ? inside.names : undefined;
  const store = useEditorStore();
  useEffect(
    () => store.run.set(run && { run, unsure, at, names: names ?? [] }),
    [store, run, unsure, at, names],
  );
}

function Inside({ id }: { id: string }) {
  const { person, visit } = usePerson();
  const { create, choose } = useNewGraphs();
  const placeable = usePlaceable(id);
  const known = useMemo(() => [...READY_TEMPLATES, ...templatesOf(placeable)], [placeable]);
  const { going, choose: chooseRun, live, run, label, unsure, inside } = useShownRun(id);
  const { runner } = useLive();
  const replay = useReplay(runner, run ?? null, useEdge(run ?? null), null);
  const past = replay.at !== null;
  const drawn = past ? replay.run : live;
  const graph = useThrottledGraph();
  const seen = useProgress(drawn, !past && unsure, replay.at, inside, graph);
  const [waits, setWaits] = useState<Waits | null>(null);
  const progress = waits?.of === seen ? waits.progress : seen;
  useRunOnCanvas(drawn, !past && unsure, replay.at, inside);
  const newest = run?.id;
  const { seek } = replay;
  // biome-ignore lint/correctness/useExhaustiveDependencies: another run is shown as it is now
  useEffect(() => seek(null), [newest, seek]);
  const begun = useLinkPart(({ seq }) => seq > 0);
  useNameColors(NAME_RANK.actors, robotNames(graph.actions));
  const seed = useSeed(runner, askedDryRun(useSearch()), graph, begun);
  const mayStart = useMay("simulate");
  const look = useStartLook(id);
  const gone = useLinkPart(
    ({ state, why, seq }) => state === "refused" && why === "no-such-graph" && seq === 0,
  );
  const { room } = useRoom();
  const who = `${visit} ${person.role} ${person.name}`;
  const entered = useRef(who);
  useEffect(() => {
    if (entered.current === who) return;
    entered.current = who;
    room.reconnect(); // under the session and the name that the person has now
  }, [who, room]);
  const settle = () => room.settled(AbortSignal.timeout(NAMED_MS)).catch(unnamed);
  if (gone) return <Gone />;
  const waiting = drawn?.ended_at === null && inside === null && (
    <RunWaits run={drawn} progress={seen} onWaits={setWaits} />
  );
  return (
    <>
      {waiting}
      <Editor
        id={id}
        me={person.id}
        known={known}
        progress={progress}
        run={live?.ended_at === null ? live.id : null}
        Bar={TitledBar}
        list={<Lists create={create} choose={choose} />}
        status={<Draft run={inside === null ? live : null} label={label} settle={settle} />}
        start={mayStart && <Start settle={settle} look={look} />}
        record={mayStart && <Record />}
        begin={mayStart && <Begin settle={settle} run={run} />}
        strip={
          <Strip
            run={run}
            cursor={replay.at}
            onSeek={seek}
            going={going}
            onChoose={chooseRun}
            versionLabel={label}
          />
        }
        seed={seed}
        held={live?.ended_at === null && <Held run={live} past={past} />}
        sign={<RunWord run={live} />}
        corner={<Corner run={live} whose={going.length > 1} />}
      />
      {mayStart && <StartLook graph={id} name={graph.name || "untitled"} look={look} />}
    </>
  );
}

function Corner(props: Pick<ComponentProps<typeof ConnectionStatus>, "run" | "whose">) {
  // Before its first answer nobody can say that the editor gives none.
  const alone = useLinkPart(
    ({ state, seq }) => state !== "live" && !(state === "connecting" && seq === 0),
  );
  return <ConnectionStatus {...props} alone={alone} />;
}

type Settled = Pick<ComponentProps<typeof StartControl>, "settle">;

function Draft(props: Settled & Pick<ComponentProps<typeof DraftStatus>, "run" | "label">) {
  const { graph, seq, obstacle } = useEditorSummary();
  return <DraftStatus {...props} graph={graph} seq={seq} obstacle={obstacle} />;
}

function Start({ settle, look }: Settled & Pick<ComponentProps<typeof StartControl>, "look">) {
  const { id, graph, seq, obstacle, blocks, asks, compact, phone } = useEditorSummary();
  const more = {
    blocks,
    asks: asks !== "" || graph.actions.some(isReadyMade) || breakpointsIn(graph).size > 0,
    compact,
    thumb: phone,
  };
  return <StartControl {...{ graph: id, seq, settle, obstacle, look, ...more }} />;
}

/** The look before a run of a part of the graph. */
function Begin({ settle, run }: Settled & { run: Run | null | undefined }) {
  const { id, graph, obstacle, beginning, endBeginning } = useEditorSummary();
  if (beginning === null) return null;
  const name = graph.name || "untitled";
  const { at, only } = beginning;
  return (
    <BeginDialog {...{ graph: id, name, settle, obstacle, at, only, run, onClose: endBeginning }} />
  );
}

/** Records the open dry-run as a run, by the decisions that were made in it. */
function Record() {
  const { id, seq, asks, obstacle: other, dryRun } = useEditorSummary();
  if (dryRun === null) return null;
  const { decided, given, close } = dryRun;
  const missing = given === null && asks === "needs" ? "to fill in" : (given?.missing ?? null);
  const obstacle = other ?? missing;
  const script = scriptOf(decided);
  const values = given?.values ?? {};
  return <RecordDryRun {...{ graph: id, seq, obstacle, script, values, onStarted: close }} />;
}

type StripProps = Omit<
  ComponentProps<typeof RunDrawer>,
  "graph" | "selected" | "point" | "onPick" | "folded" | "onFold"
>;

function Strip(props: StripProps) {
  const { graph, selected, point, pick, folded, fold } = useEditorSummary();
  const shown = { graph, selected, point, onPick: pick, folded, onFold: fold };
  return <RunDrawer {...props} {...shown} />;
}

/** The word *Run* with the sign of the state in which the run is, on the tab of a phone. */
function RunWord({ run }: { run: Run | null }) {
  return run === null ? "Run" : <RunSign run={run} />;
}

function RunSign({ run }: { run: Run }) {
  const { tone, word } = useRunStatus(run);
  return (
    <bdi className="run-sign" data-sign={STATE_LETTER[tone]} title={word}>
      Run
    </bdi>
  );
}

/** Actions of people in the run, beside the canvas of a phone. */
function Held({ run, past }: { run: Run; past: boolean }) {
  const { point } = useEditorSummary();
  return <RunSteering run={run} point={past ? null : point} />;
}

const StillSidebar = memo(Sidebar);

/** Its functions stay the same, so that it is not drawn with each event of a run. */
function Lists({ create, choose }: Pick<ReturnType<typeof useNewGraphs>, "create" | "choose">) {
  const { id, place } = useEditorSummary();
  const onNew = useStableCallback(create);
  const onImport = useStableCallback(choose);
  const onPlace = useStableCallback(place);
  return <StillSidebar current={id} onNew={onNew} onImport={onImport} onPlace={onPlace} />;
}

function TitledBar(parts: Omit<ComponentProps<typeof PageBar>, "graph">) {
  const { id } = useEditorSummary();
  const here = parts.crumbs.find(({ to, part }) => to === undefined && !part)?.label;
  useTitle((typeof here === "string" && here) || "Graph");
  return <PageBar graph={id} {...parts} />;
}

function Gone() {
  useEffect(firstViewIsThere, []);
  return (
    <Nowhere crumb="Gone" title="There is no such graph">
      It was deleted, or the address belongs to another server.
    </Nowhere>
  );
}

/** Memoized, since the screen reads the list of actions. */
const StillInside = memo(Inside);

/** Links and copies on the device know an id, and not whether it is a graph's or an action's. */
function useIsAction(id: string): boolean {
  return useKnownActions().actions.some(({ document }) => document === id);
}

export function GraphScreen({ id }: { id: string }): ReactNode {
  const { person } = usePerson();
  useEffect(() => firstViewIsThere, []); // whoever leaves before it comes
  if (useIsAction(id)) return <Redirect to={`/actions/${id}`} replace />;
  return (
    <PageFrame>
      <RoomProvider
        url={roomUrl(id)}
        keep={{ graph: id, person }}
        fallback={<PageBar crumbs={[{ label: "Graphs", to: "/" }]} />}
      >
        <EditorStoreProvider>
          <StillInside id={id} />
        </EditorStoreProvider>
      </RoomProvider>
    </PageFrame>
  );
}
