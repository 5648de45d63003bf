/** The screens that look back: runs, one run, two beside each other, statistics. */
import { useLocation } from "wouter";
import { useVersions } from "../api/graphs";
import { ComparePage } from "../review/compare-page";
import { QueuePage } from "../review/queue-page";
import { RepeatPage, RepeatsPage } from "../review/repeat-page";
import type { RepeatActions } from "../review/run-menu";
import { RunPage } from "../review/run-page";
import { RunsPage } from "../review/runs-page";
import { StatisticsPage } from "../review/statistics-page";
import { nextLabel } from "../runs/start/use-start";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { ViewPage } from "../view/view-page";
import { PageBar, PageFrame, useTitle } from "./page-frame";

const StartDialog = lazyPart(() =>
  import("../runs/start/start-dialog").then((part) => part.StartDialog),
);

export function RunsScreen() {
  useTitle("Runs");
  return (
    <PageFrame>
      <PageBar at="runs" crumbs={[{ label: "Graphs", to: "/" }, { label: "Runs" }]} />
      <RunsPage />
    </PageFrame>
  );
}

/** The page below `/runs/`: no run has the id `queue`. */
export function RunScreen({ id }: { id: string }) {
  return id === "queue" ? <QueueScreen /> : <OneRun id={id} />;
}

function OneRun({ id }: { id: string }) {
  useTitle("Run");
  return (
    <PageFrame>
      <RunPage
        id={id}
        bar={(parts) => <PageBar at="runs" run={id} {...parts} />}
        start={(again, onClose) => <Again {...again} onClose={onClose} />}
      />
    </PageFrame>
  );
}

/** A run once more: looked at, held, recorded like every other start. */
function Again({ engines, onClose, ...what }: RepeatActions & { onClose: () => void }) {
  const [, go] = useLocation();
  const versions = useVersions(what.graph).data ?? [];
  return (
    <OverlayBoundary>
      <StartDialog
        {...what}
        label={nextLabel(versions, what.seq)}
        chosen={engines}
        onChosen={() => undefined}
        onStarted={([first]) => first && go(`/runs/${first.id}`)}
        onClose={onClose}
      />
    </OverlayBoundary>
  );
}

function QueueScreen() {
  useTitle("Queue");
  return (
    <PageFrame>
      <QueuePage bar={(parts) => <PageBar at="runs" {...parts} />} />
    </PageFrame>
  );
}

export function RepeatsScreen() {
  useTitle("Repeats");
  return (
    <PageFrame>
      <RepeatsPage bar={(parts) => <PageBar at="runs" {...parts} />} />
    </PageFrame>
  );
}

export function RepeatScreen({ id }: { id: string }) {
  useTitle("Repeat");
  return (
    <PageFrame>
      <RepeatPage id={id} bar={(parts) => <PageBar at="runs" {...parts} />} />
    </PageFrame>
  );
}

export function CompareScreen() {
  useTitle("Compare runs");
  return (
    <PageFrame>
      <ComparePage bar={(parts) => <PageBar at="runs" {...parts} />} />
    </PageFrame>
  );
}

export function StatisticsScreen() {
  useTitle("Statistics");
  return (
    <PageFrame>
      <StatisticsPage bar={(parts) => <PageBar at="runs" {...parts} />} />
    </PageFrame>
  );
}

/** One graph or run of a link, which is looked back at too. */
export function ViewScreen() {
  return <ViewPage />;
}
