/** The screens around the features: home, runs, one run. */
import { useLocation } from "wouter";
import { useVersions } from "../api/graphs";
import { Home } from "../library/home";
import { ComparePage } from "../review/compare-page";
import type { RepeatActions } from "../review/run/run-menu";
import { RunPage } from "../review/run/run-page";
import { RunsPage } from "../review/runs-page";
import { StatisticsPage } from "../review/statistics-page";
import { RobotsPage } from "../robots/robots-page";
import { StartDialog } from "../runs/start/start-dialog";
import { nextLabel } from "../runs/start/use-start";
import { useNewGraphs } from "./new-graphs";
import { PageBar, PageFrame } from "./page-frame";
import { useTitle } from "./use-title";

export function HomeScreen() {
  const { create, choose } = useNewGraphs();
  useTitle("Graphs");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs" }]} />
      <Home onNew={create} onImport={choose} />
    </PageFrame>
  );
}

export function RunsScreen() {
  useTitle("Runs");
  return (
    <PageFrame>
      <PageBar at="runs" crumbs={[{ label: "Graphs", to: "/" }, { label: "Runs" }]} />
      <RunsPage />
    </PageFrame>
  );
}

export function RunScreen({ id }: { id: string }) {
  useTitle("Run");
  return (
    <PageFrame>
      <RunPage
        id={id}
        bar={(parts) => <PageBar at="runs" {...parts} />}
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
    <StartDialog
      {...what}
      label={nextLabel(versions, what.seq)}
      chosen={engines}
      onChosen={() => undefined}
      onStarted={([first]) => first && go(`/runs/${first.id}`)}
      onClose={onClose}
    />
  );
}

export function RobotsScreen() {
  const { take } = useNewGraphs();
  useTitle("Robots");
  const onImport = (text: string, name: string) => {
    void take([new File([text], `${name}.umrf.graph.json`, { type: "application/json" })]);
  };
  return (
    <PageFrame>
      <PageBar at="robots" crumbs={[{ label: "Graphs", to: "/" }, { label: "Robots" }]} />
      <RobotsPage onImport={onImport} />
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
