/** Screens whose code is loaded when they are opened, the one at hand first and others when idle. */
import type { ReactNode } from "react";
import { basePath } from "../api/page-url";
import { expectFirstView, onFirstView } from "../clock/first-view";
import { type LazyPart, lazyPart, PartBoundary, preloadParts, whenIdle } from "../ui/lazy-part";
import type { Crumb } from "../ui/top-bar";
import { useNewGraphs } from "./imports/new-graphs";
import { PageBar, PageFrame, useTitle } from "./page-frame";

const review = () => import("./review-screens");

export const HomeScreen = lazyPart(() => import("./home-screen").then((part) => part.HomeScreen));
export const GraphScreen = lazyPart(() =>
  import("./graph-screen").then((part) => part.GraphScreen),
);
const RobotsPage = lazyPart(() => import("../robots/robots-page").then((part) => part.RobotsPage));
const AdministrationPage = lazyPart(() =>
  import("../administration/administration-page").then((part) => part.AdministrationPage),
);
const PeoplePage = lazyPart(() => import("../account/people-page").then((part) => part.PeoplePage));
const AuditPage = lazyPart(() =>
  import("../administration/audit-page").then((part) => part.AuditPage),
);
const ProgramsPage = lazyPart(() =>
  import("../programs/programs-page").then((part) => part.ProgramsPage),
);
export const ActionsScreen = lazyPart(() =>
  import("./actions-screen").then((part) => part.ActionsScreen),
);
export const RunsScreen = lazyPart(() => review().then((part) => part.RunsScreen));
export const RunScreen = lazyPart(() => review().then((part) => part.RunScreen));
export const RepeatScreen = lazyPart(() => review().then((part) => part.RepeatScreen));
export const RepeatsScreen = lazyPart(() => review().then((part) => part.RepeatsScreen));
export const CompareScreen = lazyPart(() => review().then((part) => part.CompareScreen));
export const StatisticsScreen = lazyPart(() => review().then((part) => part.StatisticsScreen));
/** The page of a link that shows one thing: no screen leads there. */
export const ViewScreen = lazyPart(() => review().then((part) => part.ViewScreen));

/** The screens by the beginning of the path below the page's root; the last one is for all other paths. */
const PLACES: readonly (readonly [start: string, part: Pick<LazyPart<never>, "preload">])[] = [
  ["/graphs/", GraphScreen],
  ["/runs", RunsScreen],
  ["/robots", RobotsPage],
  ["/actions", ActionsScreen],
  ["/admin", AdministrationPage],
  ["/audit", AuditPage],
  ["/programs", ProgramsPage],
  ["/people", PeoplePage],
  ["/", HomeScreen],
];

/** Asks for the screen at this address before anything is drawn, or known of who is here. */
export function preloadAt(path: string): Promise<void> {
  const below = path.startsWith(basePath) ? path.slice(basePath.length) : path;
  const [, part] = PLACES.find(([start]) => below.startsWith(start)) ?? ["", HomeScreen];
  if (part === GraphScreen) expectFirstView();
  return part.preload();
}

/** Loads the other screens one by one while the browser is idle; not where data is to be saved. */
export async function preloadWhenIdle(): Promise<void> {
  const { connection } = navigator as { connection?: { saveData?: boolean } };
  await new Promise<void>((resolve) => onFirstView(resolve));
  if (!connection?.saveData) await preloadParts(idle);
}

const IDLE_WITHIN = 2_000; // ms for each of them

function idle(): Promise<void> {
  return new Promise((resolve) => {
    whenIdle(resolve, IDLE_WITHIN);
  });
}

/** A screen under its bar: STOP is there before the screen is, and when it never comes. */
export function Screen({ crumbs, children }: { crumbs: readonly Crumb[]; children: ReactNode }) {
  const frame = (notice: ReactNode) => (
    <PageFrame>
      <PageBar crumbs={crumbs} />
      <main>{notice}</main>
    </PageFrame>
  );
  return <PartBoundary frame={frame}>{children}</PartBoundary>;
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

export function AdministrationScreen() {
  useTitle("Administration");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: "Administration" }]} />
      <AdministrationPage />
    </PageFrame>
  );
}

export function PeopleScreen() {
  useTitle("People");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: "People" }]} />
      <PeoplePage />
    </PageFrame>
  );
}

export function AuditScreen() {
  useTitle("Audit");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: "Audit" }]} />
      <AuditPage />
    </PageFrame>
  );
}

export function ProgramsScreen() {
  useTitle("Programs");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: "Programs" }]} />
      <ProgramsPage />
    </PageFrame>
  );
}
