/** The editor of one graph: canvas, lists, details and run strip, arranged for the size of the screen. */

import {
  type ComponentType,
  createContext,
  memo,
  type ReactNode,
  use,
  useEffect,
  useMemo,
  useState,
} from "react";
import { useSearch } from "wouter";
import { useListedName } from "../api/graph-names";
import { NameOfGraph } from "../canvas/editor-store";
import { addressAround, levelsOf } from "../canvas/level-path";
import { FoldFrameContext, type NoteLinks, NoteLinksContext } from "../canvas/notes/note-buttons";
import { useTopDown } from "../canvas/top-down";
import { useOpenThreadsOnCards, useThreads } from "../comments/use-threads";
import type { DryRunSeed } from "../dry-run/seed";
import type { DryRun } from "../dry-run/use-dry-run";
import {
  addActionAt,
  type EditorContext,
  EditorReactContext,
  freePosition,
  type Panel,
  useEditorContext,
} from "../edit-actions/editor-context";
import { foldFrames } from "../edit-actions/folding";
import { pointsInside } from "../edit-actions/graph-links";
import { useShortcuts } from "../edit-actions/keys/shortcuts";
import { useRenameGraph } from "../edit-actions/rename-graph";
import type { NewAction } from "../graph/edit";
import type { Graph, Key } from "../graph/model";
import { linkableNames, linkedAction } from "../graph/note-links";
import type { ProblemGroup } from "../graph/problems/problem-groups";
import { shownName } from "../graph/questions";
import { endName } from "../graph/relation-words";
import { People } from "../people/people";
import type { Progress } from "../status/progress";
import type { RoomLink } from "../sync/room-connection";
import { useThrottledLink } from "../sync/use-room";
import { useIsPhone, useIsWide, useKept, useStableCallback } from "../ui/hooks";
import { AfterFirstView, boundedPart, Later, useOnceIdle } from "../ui/lazy-part";
import type { Crumb } from "../ui/top-bar";
import { TypingField } from "../ui/typed-ahead";
import { CanvasPane } from "./canvas-pane";
import { Overlays } from "./menus/overlays";
import { DesktopLayout, DryRunButton } from "./panels/layouts";
import { usePanels } from "./panels/use-panels";
import { blockWords, ProblemCount, useProblemGroups } from "./problem-count";
import { SaveStatus } from "./save-status";
import { useRemoteEditAnnouncements, useRunAnnouncements } from "./use-announcements";
import { useBreakpointMarks } from "./use-breakpoint-marks";
import { useEditor } from "./use-editor";
import { type Past, usePast } from "./use-past";

interface ProviderProps {
  context: EditorContext;
  children: ReactNode;
}

function EditorContextProvider({ context, children }: ProviderProps) {
  const { graph, select, view } = context;
  useBreakpointMarks(context.store, graph);
  const links = useMemo<NoteLinks>(
    () => ({
      target(link) {
        const action = linkedAction(graph.actions, link);
        return (
          action && { key: action.key, label: `${shownName(action.name)} ${action.instanceId}` }
        );
      },
      open(key) {
        select([key]);
        view.show([key]);
        view.focus(key);
      },
      names: () => linkableNames(graph.actions),
    }),
    [graph.actions, select, view],
  );
  const fold = useStableCallback((key: string, folded: boolean) =>
    foldFrames(context, [key], folded),
  );
  return (
    <EditorReactContext value={context}>
      <NoteLinksContext value={links}>
        <FoldFrameContext value={fold}>{children}</FoldFrameContext>
      </NoteLinksContext>
    </EditorReactContext>
  );
}

/** Return the name of the graph; while it is loading that of the lists, or none. */
function useShownName(id: string, { name, actions }: Graph, drawn: boolean): string {
  const listed = useListedName(id) ?? "";
  const isHere = drawn || actions.length > 0;
  return name || (isHere ? "Untitled" : listed);
}

function crumbsOf(
  context: EditorContext,
  name: string,
  search: string,
  rename: (name: string) => boolean,
): Crumb[] {
  const [only, ...others] = context.selection;
  const action = context.graph.actions.find(({ key }) => key === only);
  return [
    { label: "Graphs", to: "/" },
    ...levelsOf(search).map(({ graph }, n) => ({
      label: <NameOfGraph id={graph} />,
      to: addressAround(search, n) ?? "/",
    })),
    {
      label: name,
      ...(context.mayEdit && name !== "" && { rename }),
    },
    ...(action && others.length === 0
      ? [{ label: endName(context.graph, action.key), part: true }]
      : []),
  ];
}

const loadLevels = () => import("../levels/levels").then((part) => part.Levels);
const loadSinceMarks = () => import("../history/since-marks").then((part) => part.SinceMarks);

const loadLostDrafts = () => import("./panels/lost-drafts").then((part) => part.LostDrafts);

function LatePart({ load }: { load: () => Promise<ComponentType> }) {
  const [Part, setPart] = useState<ComponentType | null>(null);
  useEffect(() => {
    let gone = false;
    load().then(
      (part) => !gone && setPart(() => part),
      () => {},
    );
    return () => {
      gone = true;
    };
  }, [load]);
  return Part === null ? null : <Part />;
}

function LateParts() {
  return (
    <>
      <LatePart load={loadLevels} />
      <LatePart load={loadSinceMarks} />
      <LatePart load={loadLostDrafts} />
    </>
  );
}

const FindBar = boundedPart(() => import("../find/find-bar").then((part) => part.FindBar), {
  waiting: null,
});
const QuickAdd = boundedPart(() => import("./canvas/quick-add").then((part) => part.QuickAdd), {
  waiting: <TypingField />,
});
const HistoryPanel = boundedPart(() =>
  import("../history/history-panel").then((part) => part.HistoryPanel),
);
const DraftsHere = boundedPart(
  () => import("../drafts/drafts-here").then((part) => part.DraftsHere),
  { waiting: null },
);
const Inspector = boundedPart(() =>
  import("../inspector/inspector").then((part) => part.Inspector),
);
const RoomNotices = boundedPart(() => import("./room-notices").then((part) => part.RoomNotices), {
  waiting: null,
});
const LevelStatus = boundedPart(
  () => import("../levels/level-status").then((part) => part.LevelStatus),
  { waiting: null },
);
const PastDetails = boundedPart(() =>
  import("../history/past-details").then((part) => part.PastDetails),
);
const Outline = boundedPart(() => import("../outline/outline").then((part) => part.Outline));
const PhoneLayout = boundedPart(
  () => import("./panels/phone-layout").then((part) => part.PhoneLayout),
  { waiting: null },
);

/** State of the editor for the parts that the page provides, such as those of runs. */
interface EditorSummary {
  id: string;
  graph: Graph;
  dryRun: DryRun | null;
  seq: number;
  /** The reason why this moment cannot be started; null if it can. */
  obstacle: string | null;
  /** The counts of problems that keep it from being started, in words; "" without any. */
  blocks: string;
  /** A start asks for values: `needs` those without which it cannot be; else it has them. */
  asks: "" | "may" | "needs";
  selected: string | null;
  /** The only chosen action or arrow. */
  point: string | null;
  pick: (aid: string) => void;
  /** Adds an action where there is room. */
  place: (template: NewAction) => void;
  compact: boolean;
  /** Phone layout: one part at a time. */
  phone: boolean;
  /** True if the strip shows only its head; null on a phone, where it has a pane of its own. */
  folded: boolean | null;
  fold: (folded: boolean) => void;
  /** A run of a part of the graph that a person asks for; null for none. */
  beginning: { readonly at: readonly string[]; readonly only: boolean } | null;
  endBeginning: () => void;
}

const EditorSummaryContext = createContext<EditorSummary | null>(null);

export function useEditorSummary(): EditorSummary {
  const summary = use(EditorSummaryContext);
  if (summary === null) throw new Error("useEditorSummary needs an editor around it");
  return summary;
}

interface EditorBarParts {
  crumbs: readonly Crumb[];
  status?: ReactNode;
  actions?: ReactNode;
  start?: ReactNode;
}

interface Props {
  id: string;
  me: string;
  known: readonly NewAction[];
  progress: ReadonlyMap<Key, Progress>;
  /** The id of the current run; null without one. */
  run: string | null;
  Bar: ComponentType<EditorBarParts>;
  // These parts read `useEditorSummary`.
  list: ReactNode;
  strip: ReactNode;
  start: ReactNode;
  status: ReactNode;
  /** The button that turns the open dry-run into a run. */
  record: ReactNode;
  corner: ReactNode;
  /** The look before a start that does not begin at the entry. */
  begin: ReactNode;
  /** The notice of a run that waits for a person, for a phone: elsewhere the strip shows it. */
  held?: ReactNode;
  /** The word *Run* with the state of the run, for a phone. */
  sign: ReactNode;
  /** The moment of a run at which a dry-run shall start; null without one. */
  seed: DryRunSeed | null;
}

/** The result of the check of one moment (`seq`). */
interface Checked {
  readonly seq: number | undefined;
  readonly told: readonly ProblemGroup[];
}

function obstacleOf(context: EditorContext, link: RoomLink, checked: Checked, placing: boolean) {
  if (context.past !== null) return "you look at the past";
  if (link.state !== "live") return "not connected to the editor";
  if (placing) return "its cards are being placed";
  if (link.unsaved > 0) return "saving";
  if (context.graph.actions.length === 0) return "nothing to run yet";
  const blocks = checked.seq === link.seq ? blockWords(checked.told) : "";
  return blocks === "" ? null : blocks;
}

function useSummary(
  context: EditorContext,
  link: RoomLink,
  checked: Checked,
  place: EditorSummary["place"],
  begins: Pick<EditorSummary, "beginning" | "endBeginning">,
): EditorSummary & { onPlacing: (placing: boolean) => void } {
  const [placing, setPlacing] = useState(false);
  const wide = useIsWide();
  const phone = useIsPhone();
  const [folded, setFolded] = useKept("aa.strip-folded", true);
  const [selected = null] = context.graph.actions
    .filter((action) => context.selection.has(action.key))
    .map((action) => action.key);
  return {
    id: context.id,
    graph: context.graph,
    dryRun: context.dryRun,
    place,
    seq: link.seq,
    obstacle: obstacleOf(context, link, checked, placing),
    blocks: context.past === null ? blockWords(checked.told) : "",
    asks: checked.told.some(({ isAsked }) => isAsked)
      ? "needs"
      : context.graph.actions.some((action) => action.asks)
        ? "may"
        : "",
    onPlacing: setPlacing,
    selected,
    point: context.selection.size === 1 ? ([...context.selection][0] ?? null) : null,
    pick: (aid) => {
      context.select([aid]);
      context.view.show([aid]);
    },
    compact: !wide,
    phone,
    folded: phone ? null : folded,
    fold: setFolded,
    ...begins,
  };
}

interface DetailsProps {
  past: Past;
  panel: Panel;
  /** The history is open beside the canvas. */
  beside: boolean;
  children: ReactNode;
}

/** Shows the details; while the history is open, with the author of each field above them. */
function DetailsPane({ past: { place, seen }, panel, beside, children }: DetailsProps) {
  const { selection } = useEditorContext();
  if (place === null && !(beside && selection.size === 1)) return children;
  return (
    <PastDetails changes={seen?.changes ?? null} panel={panel}>
      {children}
    </PastDetails>
  );
}

/** Return the button of the dry-run followed by that of Start. */
function withDryRun(start: ReactNode): ReactNode {
  return (
    <>
      <DryRunButton />
      {start}
    </>
  );
}

/** Return the contents of the top bar for this graph. */
function barParts(
  { me, status, start }: Props,
  context: EditorContext,
  summary: EditorSummary,
  told: readonly ProblemGroup[],
  name: string,
  search: string,
  rename: (name: string) => boolean,
): EditorBarParts {
  const drawn = summary.seq > 0;
  return {
    crumbs: crumbsOf(context, name, search, rename),
    status: (
      <>
        <Later drawn={drawn}>
          <LevelStatus />
        </Later>
        <SaveStatus />
        <ProblemCount told={told} />
        {!summary.compact && <Later drawn={drawn}>{status}</Later>}
      </>
    ),
    actions: <StillPeople me={me} />,
    start: summary.phone ? null : withDryRun(start),
  };
}

/** Opens a dry-run at the moment of a run, if the address asks for one. */
function useSeededDryRun({ beginDryRun }: EditorContext, seed: DryRunSeed | null): void {
  useEffect(() => {
    if (seed !== null) beginDryRun(seed);
  }, [seed, beginDryRun]);
}

const NOTHING_TOLD: readonly never[] = [];

/** Memoized, so that the events of a run do not render the side panels again. */
const StillInspector = memo(Inspector);
const StillPeople = memo(People);

/** Adds an action where there is room. Return false if the person may not edit. */
function placeAction(context: EditorContext, template: NewAction): boolean {
  if (!context.mayEdit) return false;
  const at = freePosition(context);
  context.select([addActionAt(context, template, at)]);
  context.view.reveal(at);
  return true;
}

/** Loads panels early whose keyboard shortcuts may be followed by typing at once; the cards come before. */
const Preloads = memo(function Preloads({ drawn }: { drawn: boolean }) {
  useOnceIdle(drawn, () => {
    for (const part of [Inspector, QuickAdd, FindBar]) void part.preload();
  });
  return null;
});

export function Editor(props: Props) {
  const { id, known, progress } = props;
  const search = useSearch();
  const panels = usePanels(pointsInside(search));
  const past = usePast();
  const { context, adding, overlay, ...editor } = useEditor(
    id,
    panels.onPanel,
    past,
    panels.pane === "canvas",
  );
  const link = useThrottledLink();
  const drawn = link.seq > 0;
  const rename = useRenameGraph(context);
  const name = useShownName(id, context.graph, drawn);
  const { problems, told, marks } = useProblemGroups(id, link.seq, context.graph);
  const threads = useThreads();
  useOpenThreadsOnCards(threads);
  useRemoteEditAnnouncements(context.graph, drawn);
  useRunAnnouncements(context.graph, progress);
  useShortcuts(context);
  useSeededDryRun(context, props.seed);

  const place = (template: NewAction) => {
    if (placeAction(context, template)) panels.setLeft(false);
  };
  const beginning = overlay?.kind === "begin" ? overlay : null;
  const begins = { beginning, endBeginning: editor.closeOverlay };
  const toldNow = context.past === null ? told : NOTHING_TOLD;
  const summary = useSummary(context, link, { seq: problems?.seq, told }, place, begins);
  const { compact, phone } = summary;
  const { isTurned } = useTopDown();
  useEffect(() => {
    if (phone) void Outline.preload(); // beside the layout, which shows it first
  }, [phone]);
  const stage = (
    <CanvasPane
      key={String(phone && isTurned)}
      me={props.me}
      canvasHandle={editor.canvasHandle}
      progress={progress}
      marks={marks}
      compact={compact}
      phone={phone}
      run={props.run}
      record={props.record}
      writing={overlay?.kind === "note" ? overlay.key : null}
      corner={phone ? null : props.corner}
      onPlacing={summary.onPlacing}
      past={past}
    />
  );
  // A dry-run or the past hides the strip of runs that are over; a current run always stays
  // visible.
  const isDryOrPast = context.dryRun !== null || context.past !== null;
  const strip = isDryOrPast && props.run === null ? null : props.strip;
  const parts = {
    panels,
    stage,
    strip,
    outline: <Outline progress={progress} />,
    history: <HistoryPanel above={<DraftsHere />} />,
    find: editor.isFindOpen && (
      <FindBar problems={problems?.problems ?? []} onClose={editor.closeFind} />
    ),
    details: (
      <DetailsPane past={past} panel={editor.panel} beside={!phone && panels.side === "history"}>
        <StillInspector
          id={id}
          seq={context.past?.at ?? link.seq}
          panel={editor.panel}
          problems={context.past === null ? problems : undefined}
          told={toldNow}
          threads={threads}
        />
      </DetailsPane>
    ),
    status: props.status,
  };
  return (
    <EditorContextProvider context={context}>
      <EditorSummaryContext value={summary}>
        <props.Bar {...barParts(props, context, summary, toldNow, name, search, rename)} />
        {phone ? (
          <PhoneLayout
            {...{ ...parts, drawn, start: props.start, held: props.held, sign: props.sign }}
            onCanvas={isDryOrPast}
          />
        ) : (
          <DesktopLayout {...parts} wide={!compact} told={toldNow} list={props.list} />
        )}
        {beginning !== null && props.begin}
      </EditorSummaryContext>
      <AfterFirstView>
        <RoomNotices />
      </AfterFirstView>
      <Preloads drawn={drawn} />
      <Later drawn={drawn}>
        <LateParts />
      </Later>
      <Overlays
        drawn={drawn}
        context={context}
        known={known}
        overlay={overlay}
        onClose={editor.closeOverlay}
      />
      {adding !== null && (
        <QuickAdd context={context} request={adding} known={known} onClose={editor.closeAdd} />
      )}
    </EditorContextProvider>
  );
}
