/** Where the parts of the editor stand: one at a time on a phone, else around the canvas. */
import { ActionIcon, SegmentedControl } from "@mantine/core";
import { IconLayoutSidebar, IconLayoutSidebarRight } from "@tabler/icons-react";
import { type ReactNode, useEffect, useSyncExternalStore } from "react";
import { actionDrag } from "../canvas/action-drag";
import style from "./editor.module.css";
import { DryRunButton } from "./menus/dry-run-button";
import type { EditorSidePanel, Pane, Panels } from "./use-panels";

const SIDES = [
  { value: "library", label: "Library" },
  { value: "outline", label: "Outline" },
];

const PANES = [
  { value: "canvas", label: "Canvas" },
  { value: "outline", label: "Outline" },
  { value: "details", label: "Details" },
  { value: "run", label: "Run" },
];

interface Parts {
  panels: Panels;
  outline: ReactNode;
  stage: ReactNode;
  find: ReactNode;
  details: ReactNode;
  strip: ReactNode;
  status: () => ReactNode;
}

interface PhoneParts extends Parts {
  /** A dry-run is open: it is on the canvas. */
  dry: boolean;
  start: () => ReactNode;
}

export function PhoneLayout(props: PhoneParts) {
  const { panels, outline, stage, find, details, strip, start, status, dry } = props;
  const { pane, setPane } = panels;
  useEffect(() => {
    if (dry) setPane("canvas");
  }, [dry, setPane]);
  return (
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
        {pane === "outline" && outline}
        {pane === "details" && <div className={style.sheet}>{details}</div>}
        {pane === "run" && (
          <div className={style.sheet}>
            <div className={style.status}>{status()}</div>
            {strip}
          </div>
        )}
      </div>
      {/* Start is at the left, STOP at the right, and Dry-run keeps thumbs from meeting both. */}
      <div className={style.reach} role="toolbar" aria-label="Run">
        {start()}
        <DryRunButton stacked />
      </div>
    </main>
  );
}

/** On a narrow screen the panels lie over the canvas, one at a time. */
function PanelButtons({ panels: { left, setLeft, right, setRight } }: { panels: Panels }) {
  return (
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
  );
}

export function DeskLayout(props: Parts & { wide: boolean; list: () => ReactNode }) {
  const { wide, panels, outline, list, stage, find, details, strip, status } = props;
  const { left, right, side, setSide } = panels;
  const carrying = useSyncExternalStore(actionDrag.subscribe, actionDrag.now) !== null;
  return (
    <main className={style.editor} data-wide={wide || undefined}>
      <aside
        className={style.left}
        data-covers="left"
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
        <div className={style.side}>{side === "outline" ? outline : list()}</div>
      </aside>
      <section className={style.canvas} aria-label="Graph">
        {stage}
        {find}
        {!wide && <PanelButtons panels={panels} />}
      </section>
      <div className={style.strip}>
        {!wide && <div className={style.draft}>{status()}</div>}
        {strip}
      </div>
      <aside
        className={style.right}
        data-covers="right"
        data-open={wide || right || undefined}
        aria-label="Details"
      >
        {details}
      </aside>
    </main>
  );
}
