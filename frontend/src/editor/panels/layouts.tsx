/** Arranges the parts of the editor around the canvas. A phone has phone-layout.tsx. */

import { ActionIcon, Button } from "@mantine/core";
import {
  IconLayoutSidebar,
  IconLayoutSidebarLeftCollapse,
  IconLayoutSidebarRight,
} from "@tabler/icons-react";
import { type ReactNode, useEffect, useRef, useState } from "react";
import { actionDrag } from "../../canvas/action-drag";
import { useFirstView } from "../../clock/first-view";
import { dryRun } from "../../edit-actions/dry-run-actions";
import { isEnabled } from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ProblemGroup } from "../../graph/problems/problem-groups";
import { whenThere } from "../../ui/focus-field";
import { type ListTab, useListTab } from "../../ui/hooks";
import { AfterFirstView, boundedPart } from "../../ui/lazy-part";
import { Segments } from "../../ui/segments";
import { Tooltip } from "../../ui/tooltip";
import { useWatched } from "../../ui/watched";
import style from "./layouts.module.css";
import type { Panels } from "./use-panels";

/** Starts or closes the dry-run. `stacked`: its icon stands above its word. */
export function DryRunButton({ stacked = false }: { stacked?: boolean }) {
  const context = useEditorContext();
  const Sign = dryRun.icon;
  return (
    <Button
      className={style.dry ?? ""}
      data-stacked={stacked || undefined}
      leftSection={<Sign size={stacked ? 20 : 16} aria-hidden />}
      aria-pressed={context.dryRun !== null}
      data-pressed={context.dryRun !== null || undefined}
      disabled={!isEnabled(dryRun, context)}
      title="Play the graph on the canvas, by the engine’s rules; nothing moves"
      onClick={() => dryRun.run(context)}
    >
      {dryRun.label}
    </Button>
  );
}

const ListRail = boundedPart(() => import("./list-rail").then((part) => part.ListRail), {
  waiting: null,
});

const SIDES: readonly { value: ListTab | "outline" | "history"; label: string }[] = [
  { value: "graphs", label: "Graphs" },
  { value: "actions", label: "Actions" },
  { value: "outline", label: "Outline" },
  { value: "history", label: "History" },
];

/** The parts of an editor, whatever their layout. */
export interface Parts {
  panels: Panels;
  outline: ReactNode;
  history: ReactNode;
  stage: ReactNode;
  find: ReactNode;
  details: ReactNode;
  strip: ReactNode;
  status: ReactNode;
}

/** Opens the lists over the canvas on a narrow screen, and closes the details. */
function ListButton({ panels: { left, setLeft, setRight } }: { panels: Panels }) {
  return (
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
  );
}

function DetailsButton({ panels: { right, setLeft, setRight } }: { panels: Panels }) {
  return (
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
  );
}

/** Folds the lists beside the canvas into a rail. */
function FoldButton({ fold }: { fold: Panels["fold"] }) {
  return (
    <Tooltip label="Fold the list">
      <ActionIcon
        size={30}
        aria-label="Fold the list"
        data-fold-list
        onClick={() => {
          fold(true);
          whenThere('[data-part="Graphs"]', (button) => button.focus());
        }}
      >
        <IconLayoutSidebarLeftCollapse size={17} />
      </ActionIcon>
    </Tooltip>
  );
}

interface DesktopParts extends Parts {
  wide: boolean;
  told: readonly ProblemGroup[];
  list: ReactNode;
}

/** Chooses the list to show; actions only for people who may edit. */
function SideTabs({ panels: { side, setSide } }: { panels: Panels }) {
  const { mayEdit } = useEditorContext();
  const [tab, setTab] = useListTab();
  const list = mayEdit ? tab : "graphs";
  return (
    <Segments
      label="What is listed"
      fullWidth
      size="xs"
      data={SIDES.filter(({ value }) => mayEdit || value !== "actions")}
      value={side === "library" ? list : side}
      onChange={(next) => {
        const listed = next === "graphs" || next === "actions";
        if (listed) setTab(next);
        setSide(listed ? "library" : next);
      }}
    />
  );
}

/**
 * Return true from the first time on that a panel is open: its contents are loaded then, and stay. One that is open
 * from the beginning is filled after the first view.
 */
function useOpened(open: boolean): boolean {
  const isFirstView = useFirstView();
  const [opened, setOpened] = useState(open);
  if (open && !opened) setOpened(true);
  return opened && isFirstView;
}

/** Shows the lists beside the canvas, or over it on a narrow screen or beside a rail. */
function ListSide({ wide, panels, told, outline, history, list }: DesktopParts) {
  const { left, side, folded, fold } = panels;
  const carrying = useWatched(actionDrag) !== null;
  const beside = wide && !folded;
  const open = beside || (left && !carrying);
  const opened = useOpened(beside || left);
  return (
    <>
      {wide && folded && (
        <AfterFirstView>
          <ListRail panels={panels} told={told} />
        </AfterFirstView>
      )}
      <aside
        className={style.left}
        // A drawer that closes covers nothing any more.
        data-covers={open ? "left" : undefined}
        data-list
        data-beside={beside || undefined}
        data-over={beside ? undefined : wide ? "rail" : "edge"}
        data-open={open || undefined}
        aria-label="Library"
      >
        {opened && (
          <>
            <div className={style.sides}>
              <SideTabs panels={panels} />
              {beside && <FoldButton fold={fold} />}
            </div>
            <div className="fill-y">
              {side === "outline" ? outline : side === "history" ? history : list}
            </div>
          </>
        )}
      </aside>
    </>
  );
}

/** Keeps the selected action in view when the details open at the right. */
function useSelectedInView(open: boolean): void {
  const context = useEditorContext();
  const now = useRef(context);
  now.current = context;
  useEffect(() => {
    if (!open) return;
    const frame = requestAnimationFrame(() => {
      const { selection, positions, view } = now.current;
      const [only, ...others] = selection;
      const at = only === undefined || others.length > 0 ? undefined : positions().get(only);
      // A card that is being dragged stays under the pointer.
      if (at && document.querySelector(".react-flow__node.dragging") === null) view.reveal(at);
    });
    return () => cancelAnimationFrame(frame);
  }, [open]);
}

/**
 * Return whether the details are open, and whether their button is shown. Beside a rail they open
 * with a selection or by their button, and close when the selection ends.
 */
function useDetails(wide: boolean, { folded, right, setRight }: Panels) {
  const { selection } = useEditorContext();
  const rail = wide && folded;
  const chosen = selection.size > 0;
  const had = useRef(chosen);
  useEffect(() => {
    if (rail && had.current && !chosen) setRight(false);
    had.current = chosen;
  }, [rail, chosen, setRight]);
  return { open: rail ? chosen || right : wide || right, asked: rail ? !chosen : !wide };
}

export function DesktopLayout(props: DesktopParts) {
  const { wide, panels, stage, find, details, strip, status } = props;
  const { open, asked } = useDetails(wide, panels);
  const opened = useOpened(open);
  useSelectedInView(wide && panels.folded && open);
  return (
    <main
      className={style.editor}
      data-wide={wide || undefined}
      data-rail={(wide && panels.folded) || undefined}
      data-details={open ? "open" : "closed"}
    >
      <ListSide {...props} />
      <section className={style.canvas} aria-label="Graph" data-under-stop-notice>
        {stage}
        {find}
        {!wide && <ListButton panels={panels} />}
        {asked && <DetailsButton panels={panels} />}
      </section>
      <div className={style.strip}>
        {!wide && <div className={style.draft}>{status}</div>}
        {strip}
      </div>
      <aside
        className={style.right}
        data-covers="right"
        data-beside={wide || undefined}
        data-over={wide ? undefined : "edge"}
        data-open={open || undefined}
        aria-label="Details"
      >
        {opened && details}
      </aside>
    </main>
  );
}
