/** The page: theme, data, session, routes. */
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { Route, Router, Switch } from "wouter";
import { SignInGate } from "../account/sign-in-gate";
import { Refusal, unconfirmed } from "../api/http";
import { useLive } from "../api/page-link";
import { basePath } from "../api/page-url";
import { DragPreview } from "../canvas/action-drag";
import { NewVersionNotice } from "../offline/page-version";
import { RestQuestion } from "../runs/stop/rest-question";
import { UnansweredStartNotice } from "../status/unanswered-starts";
import { LiveRegion } from "../ui/announcer";
import { useFrontDialog } from "../ui/front-dialog";
import { AfterFirstView, lazyPart, OverlayBoundary, PartBoundary } from "../ui/lazy-part";
import { theme, variables } from "../ui/theme";
import type { Crumb } from "../ui/top-bar";
import { useWatched } from "../ui/watched";
import { DropFiles } from "./imports/drop-files";
import { importReviews } from "./imports/import-review";
import { NotFound } from "./page-frame";
import {
  ActionsScreen,
  AdministrationScreen,
  AuditScreen,
  CompareScreen,
  GraphScreen,
  HomeScreen,
  PeopleScreen,
  ProgramsScreen,
  RepeatScreen,
  RepeatsScreen,
  RobotsScreen,
  RunScreen,
  RunsScreen,
  Screen,
  StatisticsScreen,
  ViewScreen,
} from "./screens";

/**
 * Network mode of all requests: the browser's word about its network tells nothing of a server on
 * this computer or in this room. Requests are sent now or fail; none waits for a network to be sent
 * later.
 */
const NOW = "always";
const client = new QueryClient({
  defaultOptions: {
    queries: {
      networkMode: NOW,
      retry: (count, error) => !(error instanceof Refusal) && count < 3,
      refetchOnReconnect: true,
      refetchOnWindowFocus: true,
    },
    mutations: { networkMode: NOW },
  },
});

const Messages = lazyPart(() => import("../ui/messages").then((part) => part.Messages));
const ImportReviewDialog = lazyPart(() =>
  import("./imports/import-review-dialog").then((part) => part.ImportReviewDialog),
);

/** Once something had to be looked at, the dialog stays: it goes out of sight by itself. */
function ImportReview() {
  const [asked, setAsked] = useState(false);
  const waits = useWatched(importReviews) !== null;
  useEffect(() => setAsked((was) => was || waits), [waits]);
  return <OverlayBoundary>{asked && <ImportReviewDialog />}</OverlayBoundary>;
}

const ConfirmDialog = lazyPart(() =>
  import("../account/confirm-dialog").then((part) => part.ConfirmDialog),
);
const ConfirmQuestion = lazyPart(() =>
  import("../account/confirm-question").then((part) => part.ConfirmQuestion),
);

const Notifier = lazyPart(() => import("../account/notifier").then((part) => part.Notifier));

/** Asks for confirmations of this page, and shows those that another device asks it for. */
function Confirmations() {
  const wanted = useWatched(unconfirmed) !== null;
  const asked = useLive().now.asked.length > 0;
  const [opened, setOpened] = useState(false);
  useEffect(() => setOpened((was) => was || wanted), [wanted]);
  useFrontDialog(wanted, () => unconfirmed.set(null));
  return (
    <OverlayBoundary>
      {opened && <ConfirmDialog />}
      {asked && <ConfirmQuestion />}
    </OverlayBoundary>
  );
}

const graphs: Crumb = { label: "Graphs", to: "/" };
const runs: Crumb = { label: "Runs", to: "/runs" };

function Screens() {
  return (
    <Switch>
      <Route path="/">
        <Screen crumbs={[{ label: "Graphs" }]}>
          <HomeScreen />
        </Screen>
      </Route>
      <Route path="/graphs/:id">
        {({ id }) => (
          <Screen crumbs={[graphs]} key={id}>
            <GraphScreen id={id} />
          </Screen>
        )}
      </Route>
      <Route path="/actions/:id?">
        {({ id }) => (
          <Screen crumbs={[graphs, { label: "Actions" }]}>
            <ActionsScreen id={id ?? null} />
          </Screen>
        )}
      </Route>
      <Route path="/robots">
        <Screen crumbs={[graphs, { label: "Robots" }]}>
          <RobotsScreen />
        </Screen>
      </Route>
      <Route path="/admin">
        <Screen crumbs={[graphs, { label: "Administration" }]}>
          <AdministrationScreen />
        </Screen>
      </Route>
      <Route path="/people">
        <Screen crumbs={[graphs, { label: "People" }]}>
          <PeopleScreen />
        </Screen>
      </Route>
      <Route path="/audit">
        <Screen crumbs={[graphs, { label: "Audit" }]}>
          <AuditScreen />
        </Screen>
      </Route>
      <Route path="/programs">
        <Screen crumbs={[graphs, { label: "Programs" }]}>
          <ProgramsScreen />
        </Screen>
      </Route>
      <Route path="/runs">
        <Screen crumbs={[graphs, { label: "Runs" }]}>
          <RunsScreen />
        </Screen>
      </Route>
      <Route path="/runs/compare">
        <Screen crumbs={[graphs, runs]}>
          <CompareScreen />
        </Screen>
      </Route>
      <Route path="/runs/statistics">
        <Screen crumbs={[graphs, runs]}>
          <StatisticsScreen />
        </Screen>
      </Route>
      <Route path="/runs/repeats">
        <Screen crumbs={[graphs, runs]}>
          <RepeatsScreen />
        </Screen>
      </Route>
      <Route path="/runs/repeats/:id">
        {({ id }) => (
          <Screen crumbs={[graphs, runs]} key={id}>
            <RepeatScreen id={id} />
          </Screen>
        )}
      </Route>
      <Route path="/runs/:id">
        {({ id }) => (
          <Screen crumbs={[graphs, runs]} key={id}>
            <RunScreen id={id} />
          </Screen>
        )}
      </Route>
      <Route component={NotFound} />
    </Switch>
  );
}

export function App() {
  return (
    <MantineProvider theme={theme} cssVariablesResolver={variables} defaultColorScheme="auto">
      <OverlayBoundary>
        <AfterFirstView>
          <Messages />
        </AfterFirstView>
      </OverlayBoundary>
      <QueryClientProvider client={client}>
        <Router base={basePath}>
          <SignInGate>
            <DropFiles>
              <Screens />
              <ImportReview />
              <RestQuestion />
              <UnansweredStartNotice />
              <Confirmations />
              <DragPreview />
              <NewVersionNotice />
              <LiveRegion />
              <OverlayBoundary>
                <AfterFirstView>
                  <Notifier />
                </AfterFirstView>
              </OverlayBoundary>
            </DropFiles>
          </SignInGate>
        </Router>
      </QueryClientProvider>
    </MantineProvider>
  );
}

/** The page of a link that shows one thing: without a session, menus, shortcuts and STOP. */
export function ViewApp() {
  return (
    <MantineProvider theme={theme} cssVariablesResolver={variables} defaultColorScheme="auto">
      <PartBoundary frame={(notice) => <main>{notice}</main>}>
        <ViewScreen />
      </PartBoundary>
    </MantineProvider>
  );
}
