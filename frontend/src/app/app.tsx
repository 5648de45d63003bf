/** The page: theme, data, session, routes. */
import { MantineProvider } from "@mantine/core";
import { Notifications } from "@mantine/notifications";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { Route, Router, Switch } from "wouter";
import { NamePrompt } from "../account/name-prompt";
import { SignInGate } from "../account/sign-in-gate";
import { Refusal } from "../api/http";
import { LiveProvider } from "../api/live/use-live";
import { basePath } from "../api/page-url";
import { usePerson } from "../api/use-person";
import { actionDrag } from "../canvas/action-drag";
import { UnansweredStartNotice } from "../runs/start/unanswered-start-notice";
import { StopNotice } from "../runs/stop/stop-notice";
import { LiveRegion } from "../ui/announcer";
import { DragPreview } from "../ui/pointer-drag";
import { theme, variables } from "../ui/theme";
import { DropFiles } from "./drop-files";
import { GraphScreen } from "./graph-screen";
import { ImportReviewDialog } from "./import-review-dialog";
import { NotFound } from "./not-found";
import {
  CompareScreen,
  HomeScreen,
  RobotsScreen,
  RunScreen,
  RunsScreen,
  StatisticsScreen,
} from "./screens";

const client = new QueryClient({
  defaultOptions: {
    queries: {
      retry: (count, error) => !(error instanceof Refusal) && count < 3,
      refetchOnWindowFocus: true,
    },
  },
});

/** The runner hears of a new name by a new socket. */
function LiveConnection({ children }: { children: ReactNode }) {
  const { person, visit } = usePerson();
  return (
    <LiveProvider who={`${visit} ${person.id} ${person.role} ${person.name}`}>
      {children}
    </LiveProvider>
  );
}

export function App() {
  return (
    <MantineProvider theme={theme} cssVariablesResolver={variables} defaultColorScheme="auto">
      <Notifications position="bottom-right" zIndex={350} />
      <QueryClientProvider client={client}>
        <Router base={basePath}>
          <SignInGate>
            <LiveConnection>
              <DropFiles>
                <Switch>
                  <Route path="/" component={HomeScreen} />
                  <Route path="/graphs/:id">{({ id }) => <GraphScreen key={id} id={id} />}</Route>
                  <Route path="/robots" component={RobotsScreen} />
                  <Route path="/runs" component={RunsScreen} />
                  <Route path="/runs/compare" component={CompareScreen} />
                  <Route path="/runs/statistics" component={StatisticsScreen} />
                  <Route path="/runs/:id">{({ id }) => <RunScreen key={id} id={id} />}</Route>
                  <Route component={NotFound} />
                </Switch>
                <NamePrompt />
                <ImportReviewDialog />
                <StopNotice />
                <UnansweredStartNotice />
                <DragPreview carrier={actionDrag} />
                <LiveRegion />
              </DropFiles>
            </LiveConnection>
          </SignInGate>
        </Router>
      </QueryClientProvider>
    </MantineProvider>
  );
}
