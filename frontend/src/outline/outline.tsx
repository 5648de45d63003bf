/**
 * The graph as a tree grid: everything the canvas does, for keyboard, touch and screen readers.
 *
 * Rows are walked with the arrow keys (right opens, left closes or goes up) and each has its actions
 * by key and in a menu. What is selected here is selected on the canvas, and the other way round.
 */
import { Button, Kbd } from "@mantine/core";
import { IconListTree, IconPlus } from "@tabler/icons-react";
import { useCallback, useEffect, useMemo, useRef, useState } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import { ENTRY, type Graph, type Key } from "../graph/model";
import { type RobotOf, robotOf } from "../graph/robots";
import type { Progress } from "../status/progress";
import { useSelectedByOthers } from "../sync/use-room";
import { announcer } from "../ui/announcer";
import { Empty } from "../ui/empty";
import { useIsPhone } from "../ui/hooks";
import { keyOf } from "../ui/keys";
import { useWatched } from "../ui/watched";
import { isolated } from "../words/isolated";
import { useRunningRow } from "./follow-rows";
import style from "./outline.module.css";
import { OutlineRow, type RowHandlers } from "./outline-row";
import { PhoneRow } from "./phone-row";
import { RobotFilter } from "./robot-filter";
import {
  moveRow,
  type RowAction,
  type RowEditKind,
  removeRow,
  rowActionFor,
  toggleBreakpoint,
} from "./row-actions";
import { type BundleRow, bundlesOf, namesOf, type OutlineItem, rowsOf, subjectOf } from "./rows";

const MANY = 40; // actions; above that the rows begin closed

interface Edited {
  readonly row: OutlineItem;
  readonly change: RowEditKind;
}

const closed = () => false;
const NO_BUNDLES: readonly BundleRow[] = [];

/** Returns true if this row is edited, or a bundle that is shown in it. */
const isOf = (edited: Edited | null, row: OutlineItem): boolean =>
  edited !== null && (edited.row.id === row.id || edited.row.parent === row.id);

/** Keeps which rows are open: as a person opened or closed them, else by the number of actions. */
function useOpen(actions: number) {
  const [flipped, setFlipped] = useState<ReadonlySet<string>>(new Set());
  const byDefault = actions <= MANY;
  const isOpen = useCallback(
    (id: string) => (id.includes("|") ? true : byDefault) !== flipped.has(id),
    [byDefault, flipped],
  );
  const flip = (id: string) =>
    setFlipped((before) => {
      const next = new Set(before);
      if (!next.delete(id)) next.add(id);
      return next;
    });
  return { isOpen, flip };
}

/** The row to which an arrow key leads from the one at `at`; null where it opens or closes. */
function stepFrom(rows: readonly OutlineItem[], at: number, key: string): number | null {
  const row = rows[at];
  switch (key) {
    case "ArrowDown":
      return Math.min(at + 1, rows.length - 1);
    case "ArrowUp":
      return Math.max(at - 1, 0);
    case "Home":
      return 0;
    case "End":
      return rows.length - 1;
    case "ArrowRight":
      return row?.open ? at + 1 : null;
    case "ArrowLeft":
      return row?.open ? null : rows.findIndex(({ id }) => id === row?.parent);
    default:
      return null;
  }
}

export function Outline({ progress }: { progress: ReadonlyMap<Key, Progress> }) {
  const context = useEditorContext();
  const { graph, selection, select, setPanel, mayEdit, store } = context;
  const phone = useIsPhone();
  const others = useSelectedByOthers();
  const { isOpen, flip } = useOpen(graph.actions.length);
  const robot = useWatched(store.robot);
  const expanded = useWatched(store.expanded);
  const run = useWatched(store.run);
  // biome-ignore lint/correctness/useExhaustiveDependencies: with each change of the run there are other states
  const rows = useMemo(() => {
    const all = rowsOf(graph, phone ? closed : isOpen, expanded?.partsOf);
    if (robot === null) return all;
    const lit = new Set(graph.actions.filter(({ actor }) => actor === robot).map(({ key }) => key));
    return all.filter((row) => row.kind === "entry" || lit.has(ownerOf(row)));
  }, [graph, isOpen, robot, phone, expanded, run]);
  const names = useMemo(() => namesOf(graph), [graph]);
  const robots = useMemo(() => robotOf(graph), [graph]);
  const [only] = selection.size === 1 ? selection : [];
  const chosen = () => rows.find((row) => subjectOf(row) === only);
  const [active, setActive] = useState<string>(() => chosen()?.id ?? ENTRY);
  const [edited, setEdited] = useState<Edited | null>(null);
  const tree = useRef<HTMLTableElement>(null);
  const list = useRef<HTMLDivElement>(null);
  useRunningRow(list, progress, phone);
  const at = Math.max(
    0,
    rows.findIndex(({ id }) => id === active),
  );

  const focus = (index: number) => {
    const row = rows[index];
    if (row === undefined) return;
    setActive(row.id);
    tree.current
      ?.querySelector<HTMLElement>(`[data-row="${CSS.escape(row.id)}"]`)
      ?.focus({ preventScroll: false });
  };
  const choose = (row: OutlineItem) => {
    setActive(row.id);
    if (row.kind === "inside") return store.graphsInside.now()?.enter(row.part.path);
    const subject = subjectOf(row);
    select([subject]);
    if (!phone) context.view.show(subject.split(">").map((end) => end.split(";")[0] ?? end));
  };
  // A selection that was made elsewhere is scrolled into view here, too.
  useEffect(() => {
    if (only === undefined || tree.current?.contains(document.activeElement)) return;
    const row = rows.find((candidate) => subjectOf(candidate) === only);
    if (row === undefined || row.id === active) return;
    setActive(row.id);
    const found = tree.current?.querySelector(`[data-row="${CSS.escape(row.id)}"]`);
    found?.scrollIntoView({ block: "nearest" });
  }, [only, rows, active]);

  const act = (rowAction: RowAction, row: OutlineItem) => {
    if (rowAction.changes && !mayEdit) return;
    switch (rowAction.name) {
      case "details":
        choose(row);
        setPanel("details");
        break;
      case "comments":
        choose(row);
        setPanel("comments");
        break;
      case "enter":
        store.graphsInside.now()?.enter(subjectOf(row));
        break;
      case "expand":
        store.graphsInside.now()?.expand.toggle(subjectOf(row));
        break;
      case "breakpoint":
        announcer.say(toggleBreakpoint(context, row));
        break;
      case "delete":
        announcer.say(removeRow(context, row));
        focus(Math.max(0, at - 1));
        break;
      case "up":
      case "down":
        announcer.say(moveRow(context, row, rowAction.name === "up" ? -1 : 1));
        break;
      default:
        setActive(row.id);
        setEdited({ row, change: rowAction.name });
    }
  };
  const onKey = (event: React.KeyboardEvent) => {
    const row = rows[at];
    const target = event.target as HTMLElement;
    if (row === undefined || target.dataset.row === undefined || event.ctrlKey || event.metaKey)
      return;
    const key = keyOf(event);
    const rowAction = rowActionFor(row, event, store);
    const next = event.altKey ? null : stepFrom(rows, at, key);
    const opens = key === "ArrowRight" && row.open === false;
    const closes = key === "ArrowLeft" && row.open === true;
    if (opens || closes) flip(row.id);
    else if (next !== null && next >= 0) focus(next);
    else if (key === " ") choose(row);
    else if (rowAction) act(rowAction, row);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const done = (said: string | null) => {
    setEdited(null);
    if (said !== null) announcer.say(said);
    focus(at);
  };
  const latest = useRef<RowHandlers | null>(null);
  latest.current = {
    flip,
    focus: setActive,
    choose: (row) => (phone && row.kind !== "inside" ? act(DETAILS, row) : choose(row)),
    run: act,
    done,
  };
  const handlers = useMemo((): RowHandlers => {
    const now = () => latest.current as RowHandlers;
    return {
      flip: (id) => now().flip(id),
      focus: (id) => now().focus(id),
      choose: (row) => now().choose(row),
      run: (rowAction, row) => now().run(rowAction, row),
      done: (said) => now().done(said),
    };
  }, []);
  const add = () => {
    const middle: [number, number] = [window.innerWidth / 2, 120];
    if (!phone) return context.openAdd();
    context.openAdd({ screen: middle, at: null, from: null });
  };
  const shown = { rows, at, selection, progress, edited, names, robots, others, mayEdit, handlers };
  return (
    <div className={style.outline} ref={list}>
      <div className={style.robots}>
        <RobotFilter />
      </div>
      {rows.length === 1 && graph.actions.length === 0 && (
        <Empty icon={<IconListTree size={22} />} title="Nothing here yet">
          The actions of the graph are listed here, in the order in which they run.
        </Empty>
      )}
      {(rows.length > 1 || graph.actions.length > 0) && (
        <table
          ref={tree}
          className={style.tree}
          // biome-ignore lint/a11y/noNoninteractiveElementToInteractiveRole: WAI-ARIA names table as its element
          role="treegrid"
          aria-label={`Outline of ${isolated(graph.name || "the graph")}`}
          aria-rowcount={rows.length}
          tabIndex={-1}
          onKeyDown={onKey}
        >
          <tbody>{phone ? <PhoneRows {...shown} graph={graph} /> : <Rows {...shown} />}</tbody>
        </table>
      )}
      {mayEdit && (
        <Button className={style.add ?? ""} leftSection={<IconPlus size={16} />} onClick={add}>
          Add an action
        </Button>
      )}
      {!phone && graph.actions.length > 0 && (
        <p className={style.keys}>
          <Kbd>↑</Kbd> <Kbd>↓</Kbd> walk, <Kbd>←</Kbd> <Kbd>→</Kbd> close and open, <Kbd>Enter</Kbd>{" "}
          details, <Kbd>F2</Kbd> rename, <Kbd>C</Kbd> connect, <Kbd>Alt ↑</Kbd> move, <Kbd>Del</Kbd>{" "}
          delete
        </p>
      )}
    </div>
  );
}

interface ShownRows {
  rows: readonly OutlineItem[];
  /** The row that the keyboard is at. */
  at: number;
  selection: ReadonlySet<string>;
  progress: ReadonlyMap<Key, Progress>;
  edited: Edited | null;
  names: ReadonlyMap<Key, string>;
  robots: RobotOf;
  others: ReturnType<typeof useSelectedByOthers>;
  mayEdit: boolean;
  handlers: RowHandlers;
}

const progressOf = (row: OutlineItem, progress: ShownRows["progress"]): Progress | null =>
  row.kind === "action" ? (progress.get(row.action.key) ?? null) : null;

function Rows({ rows, at, selection, progress, edited, ...props }: ShownRows) {
  const { names, robots, others, mayEdit, handlers } = props;
  return rows.map((row, i) => (
    <OutlineRow
      key={row.id}
      row={row}
      active={i === at}
      selected={selection.has(subjectOf(row))}
      progress={progressOf(row, progress)}
      change={edited?.row.id === row.id ? edited.change : null}
      name={names.get(nameKey(row)) ?? ""}
      robots={robots}
      others={others.get(subjectOf(row))}
      mayEdit={mayEdit}
      handlers={handlers}
    />
  ));
}

function PhoneRows({ graph, rows, at, selection, ...props }: ShownRows & { graph: Graph }) {
  const { progress, edited, names, robots, others, mayEdit, handlers } = props;
  const bundles = useMemo(() => bundlesOf(graph), [graph]);
  const order = useMemo(() => new Map(rows.map(({ id }, i) => [id, i])), [rows]);
  return rows.map((row, i) => {
    const own = bundles.get(row.id) ?? NO_BUNDLES;
    return (
      <PhoneRow
        key={row.id}
        row={row}
        bundles={own}
        active={i === at}
        selected={[row, ...own].some((each) => selection.has(subjectOf(each)))}
        progress={progressOf(row, progress)}
        edited={isOf(edited, row) ? edited : null}
        names={names}
        robots={robots}
        order={order}
        others={others.get(subjectOf(row))}
        mayEdit={mayEdit}
        handlers={handlers}
      />
    );
  });
}

const DETAILS: RowAction = { name: "details", label: "Details", key: "Enter", changes: false };

/** By whose name a row is called. */
const nameKey = (row: OutlineItem): Key =>
  row.kind === "target" ? row.relation.child : ownerOf(row);

function ownerOf(row: OutlineItem): Key {
  switch (row.kind) {
    case "entry":
      return ENTRY;
    case "action":
    case "outcome":
      return row.action.key;
    case "target":
      return row.relation.parent;
    case "note":
      return row.note.key;
    case "inside":
      return row.part.path.split("/")[0] ?? "";
  }
}
