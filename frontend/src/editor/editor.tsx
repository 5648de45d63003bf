/** The editor of one graph: list, canvas, details and run strip, arranged for the screen at hand. */
import { ActionIcon, SegmentedControl } from "@mantine/core";
import { useLocalStorage } from "@mantine/hooks";
import { IconLayoutSidebar, IconLayoutSidebarRight } from "@tabler/icons-react";
import { type ReactNode, useCallback, useMemo, useState, useSyncExternalStore } from "react";
import type { Script } from "../api/dry-runs";
import { type Problems, useProblems } from "../api/graphs";
import { actionDrag } from "../canvas/action-drag";
import { problemMarksOf } from "../canvas/problem-marks";
import { useOpenThreadsOnCards, useThreads } from "../comments/use-threads";
import { scriptOf } from "../dry-run/script";
import {
  addActionAt,
  type EditorContext,
  EditorReactContext,
  freePosition,
  type Panel,
} from "../edit-actions/editor-context";
import { useShortcuts } from "../edit-actions/shortcuts";
import { FindBar } from "../find/find-bar";
import type { NewAction } from "../graph/edit";
import type { Graph, Key } from "../graph/model";
import { Inspector } from "../inspector/inspector";
import { Outline } from "../outline/outline";
import { People } from "../people/people";
import type { Progress } from "../status/progress";
import type { RoomLink } from "../sync/room-connection";
import { useThrottledLink } from "../sync/use-room";
import type { Crumb } from "../ui/top-bar";
import { useIsPhone, useIsWide } from "../ui/use-screen-size";
import { QuickAdd } from "./canvas/quick-add";
import { CanvasPane } from "./canvas-pane";
import style from "./editor.module.css";
import { Overlays } from "./menus/overlays";
import { ProblemCount } from "./problem-count";
import { RoomNotices } from "./room-notices";
import { SaveStatus } from "./save-status";
import { useRemoteEditAnnouncements, useRunAnnouncements } from "./use-announcements";
import { useEditor } from "./use-editor";

/** What the page around the editor may want to know. */
export interface Shown {
  graph: Graph;
  seq: number;
  /** Why this moment cannot be started; null when it can. */
  obstacle: string | null;
  selected: string | null;
  pick: (aid: string) => void;
  compact: boolean;
  /** The strip shows its head only. Null where it has a place of its own. */
  folded: boolean | null;
  fold: (folded: boolean) => void;
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
  /** The run that goes, if one does. */
  run: string | null;
  bar: (parts: EditorBarParts) => ReactNode;
  list: (place: (template: NewAction) => void) => ReactNode;
  strip: (shown: Shown) => ReactNode;
  start: (shown: Shown) => ReactNode;
  status: (shown: Shown) => ReactNode;
  /** Makes the dry-run that is open a run. */
  record: (shown: Shown, script: Script, onStarted: () => void) => ReactNode;
  corner: ReactNode;
}

type Pane = "canvas" | "outline" | "details" | "run";

type EditorSidePanel = "library" | "outline";

const SIDES = [
  { value: "library", label: "Library" },
  { value: "outline", label: "Outline" },
];

function focusOutline(): void {
  document.querySelector<HTMLElement>('[role="treegrid"] [data-row][tabindex="0"]')?.focus();
}

const PANES = [
  { value: "canvas", label: "Canvas" },
  { value: "outline", label: "Outline" },
  { value: "details", label: "Details" },
  { value: "run", label: "Run" },
];

function obstacleOf(context: EditorContext, link: RoomLink, problems: Problems | undefined) {
  if (link.state !== "live") return "not connected to the editor";
  if (link.unsaved > 0) return "saving";
  if (context.graph.actions.length === 0) return "nothing to run yet";
  const errors = problems?.problems.filter((problem) => problem.severity === "error").length ?? 0;
  if (errors > 0 && problems?.seq === link.seq) {
    return errors === 1 ? "1 problem must be solved" : `${errors} problems must be solved`;
  }
  return null;
}

/** Where one is: the graphs, this one, and what of it is chosen. */
function crumbsOf(context: EditorContext): Crumb[] {
  const [only, ...others] = context.selection;
  const action = context.graph.actions.find(({ key }) => key === only);
  return [
    { label: "Graphs", to: "/" },
    { label: context.graph.name || "Untitled" },
    ...(action && others.length === 0
      ? [{ label: `${action.name} ${action.instanceId}`, part: true }]
      : []),
  ];
}

export function Editor(props: Props) {
  const { id, known, progress } = props;
  const wide = useIsWide();
  const phone = useIsPhone();
  const [left, setLeft] = useState(false);
  const [right, setRight] = useState(false);
  const [pane, setPane] = useState<Pane>("canvas");
  const [folded, setFolded] = useLocalStorage({
    key: "aa.strip-folded",
    defaultValue: false,
    getInitialValueInEffect: false,
  });
  const carrying = useSyncExternalStore(actionDrag.subscribe, actionDrag.now) !== null;
  const [side, setSide] = useState<EditorSidePanel>("library");
  const onPanel = useCallback((next: Panel) => {
    const outline = next === "outline";
    if (outline) setSide("outline");
    setRight(!outline);
    setLeft(outline);
    setPane((now) => (outline ? "outline" : now === "outline" ? "details" : now));
    if (outline) requestAnimationFrame(focusOutline);
  }, []);
  const {
    context,
    panel,
    adding,
    finding,
    overlay,
    canvasHandle,
    closeAdd,
    closeFind,
    closeOverlay: close,
  } = useEditor(id, onPanel);
  const link = useThrottledLink();
  const problems = useProblems(id, link.seq).data;
  const marks = useMemo(() => problemMarksOf(problems?.problems ?? []), [problems]);
  const threads = useThreads();
  useOpenThreadsOnCards(threads);
  useRemoteEditAnnouncements(context.graph, link.seq > 0);
  useRunAnnouncements(context.graph, progress);
  useShortcuts(context);

  const place = (template: NewAction) => {
    if (!context.mayEdit) return;
    const at = freePosition(context);
    context.select([addActionAt(context, template, at)]);
    context.view.reveal(at);
    setLeft(false);
  };
  const [selected = null] = context.graph.actions
    .filter((action) => context.selection.has(action.key))
    .map((action) => action.key);
  const shown: Shown = {
    graph: context.graph,
    seq: link.seq,
    obstacle: obstacleOf(context, link, problems),
    selected,
    pick: (aid) => {
      context.select([aid]);
      context.view.show([aid]);
    },
    compact: !wide,
    folded: phone ? null : folded,
    fold: setFolded,
  };
  const stage = (
    <CanvasPane
      me={props.me}
      canvasHandle={canvasHandle}
      progress={progress}
      marks={marks}
      compact={!wide}
      phone={phone}
      run={props.run}
      record={
        context.dryRun &&
        props.record(shown, scriptOf(context.dryRun.decided), context.dryRun.close)
      }
      writing={overlay?.kind === "note" ? overlay.key : null}
      corner={phone ? null : props.corner}
    />
  );
  // A dry-run is told apart from runs that are over; one that goes on is never out of sight.
  const strip = context.dryRun && props.run === null ? null : props.strip(shown);
  const details = (
    <Inspector id={id} seq={link.seq} panel={panel} problems={problems} threads={threads} />
  );
  const find = finding && <FindBar problems={problems?.problems ?? []} onClose={closeFind} />;
  return (
    <EditorReactContext value={context}>
      {props.bar({
        crumbs: crumbsOf(context),
        status: (
          <>
            <SaveStatus />
            <ProblemCount problems={problems} />
            {wide && props.status(shown)}
          </>
        ),
        actions: <People me={props.me} />,
        start: phone ? null : props.start(shown),
      })}
      {phone ? (
        <main className={style.phone}>
          <SegmentedControl
            className={style.segments ?? ""}
            fullWidth
            data={PANES}
            value={pane}
            onChange={(next) => setPane(next as Pane)}
          />
          <div className={style.pane}>
            {find}
            {pane === "canvas" && stage}
            {pane === "outline" && <Outline progress={progress} />}
            {pane === "details" && <div className={style.sheet}>{details}</div>}
            {pane === "run" && (
              <div className={style.sheet}>
                <div className={style.start}>{props.start(shown)}</div>
                <div className={style.status}>{props.status(shown)}</div>
                {strip}
              </div>
            )}
          </div>
        </main>
      ) : (
        <main className={style.editor} data-wide={wide || undefined}>
          <aside
            className={style.left}
            data-open={wide || (left && !carrying) || undefined}
            aria-label="Library"
          >
            <SegmentedControl
              className={style.sides ?? ""}
              fullWidth
              size="xs"
              data={SIDES}
              value={side}
              onChange={(next) => setSide(next as EditorSidePanel)}
            />
            <div className={style.side}>
              {side === "outline" ? <Outline progress={progress} /> : props.list(place)}
            </div>
          </aside>
          <section className={style.canvas} aria-label="Graph">
            {stage}
            {find}
            {!wide && (
              <>
                <ActionIcon
                  size={40}
                  variant="default"
                  className={style.toLeft ?? ""}
                  aria-label="Graphs and actions"
                  aria-pressed={left}
                  onClick={() => {
                    setLeft(!left);
                    setRight(false);
                  }}
                >
                  <IconLayoutSidebar size={18} />
                </ActionIcon>
                <ActionIcon
                  size={40}
                  variant="default"
                  className={style.toRight ?? ""}
                  aria-label="Details"
                  aria-pressed={right}
                  onClick={() => {
                    setRight(!right);
                    setLeft(false);
                  }}
                >
                  <IconLayoutSidebarRight size={18} />
                </ActionIcon>
              </>
            )}
          </section>
          <div className={style.strip}>
            {!wide && <div className={style.draft}>{props.status(shown)}</div>}
            {strip}
          </div>
          <aside
            className={style.right}
            data-open={wide || right || undefined}
            aria-label="Details"
          >
            {details}
          </aside>
        </main>
      )}
      <RoomNotices />
      <Overlays context={context} overlay={overlay} onClose={close} />
      {adding && <QuickAdd context={context} request={adding} known={known} onClose={closeAdd} />}
    </EditorReactContext>
  );
}
