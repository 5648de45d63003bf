/** Arranges the parts of the editor on a phone: one at a time, the outline first. */
import { Skeleton } from "@mantine/core";
import { type ReactNode, useEffect } from "react";
import { Segments } from "../../ui/segments";
import { DryRunButton, type Parts } from "./layouts";
import style from "./layouts.module.css";
import { useFirstViewEnd } from "./use-first-view-end";
import type { Pane } from "./use-panels";

const PANES: readonly { value: Pane; label: string }[] = [
  { value: "outline", label: "Outline" },
  { value: "canvas", label: "Canvas" },
  { value: "history", label: "History" },
  { value: "details", label: "Details" },
];

interface PhoneParts extends Parts {
  /** The graph has arrived. */
  drawn: boolean;
  /** A dry-run is open or the past is shown; both need the canvas. */
  onCanvas: boolean;
  start: ReactNode;
  /** The notice of a run that waits for a person; the run's own pane shows it too. */
  held: ReactNode;
  /** The word *Run* with the state of the run. */
  sign: ReactNode;
}

/** Rows in the place of those that have not arrived yet. */
function WaitingRows() {
  useFirstViewEnd(false);
  return (
    <div className="stack gap-75 p-75" aria-busy="true">
      {[0, 1, 2].map((row) => (
        <Skeleton key={row} height={84} radius="md" />
      ))}
    </div>
  );
}

function Rows({ children }: { children: ReactNode }) {
  useFirstViewEnd(true);
  return children;
}

export function PhoneLayout(props: PhoneParts) {
  const { panels, outline, history, stage, find, details, strip, start, held, status } = props;
  const { drawn, onCanvas, sign } = props;
  const { pane, setPane, choosePane } = panels;
  useEffect(() => {
    if (onCanvas) setPane("canvas");
  }, [onCanvas, setPane]);
  return (
    <main className="column">
      <Segments
        className={style.segments ?? ""}
        fullWidth
        data={[...PANES, { value: "run", label: sign }]}
        value={pane}
        onChange={choosePane}
      />
      {pane !== "run" && held}
      <div className="fill-y relative border-top">
        {find}
        {pane === "canvas" && stage}
        {pane === "outline" && (drawn ? <Rows>{outline}</Rows> : <WaitingRows />)}
        {pane === "history" && history}
        {pane === "details" && <div className="column bg-panel">{details}</div>}
        {pane === "run" && (
          <div className="column bg-panel">
            <div className={style.status}>{status}</div>
            {strip}
          </div>
        )}
      </div>
      {/* Start is at the left and STOP at the right; Dry-run keeps them apart. */}
      <div className={style.reach} role="toolbar" aria-label="Run">
        {start}
        <DryRunButton stacked />
      </div>
    </main>
  );
}
