// @vitest-environment jsdom

import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test } from "vitest";
import { PersonContext } from "../api/people";
import type { Run } from "../api/runs";
import { adaAs, standInForBrowser } from "../testing/browser";
import { plain } from "../testing/texts";
import { RunPage } from "./run-page";

standInForBrowser();

/** Stands in each name and value of what is hidden: the page shows none of it, even if it has it. */
const CANARY = "Canary";
const run = {
  id: "r",
  number: 7,
  hidden: true,
  engine: "David",
  robots: null,
  simulated: false,
  state: "running",
  desired: "running",
  author: { id: "p", name: "Mari" },
  stopped_by: null,
  requested_at: "2026-11-20T08:00:00Z",
  started_at: "2026-11-20T08:00:01Z",
  ended_at: null,
  unknown_since: null,
  proof_at: null,
  alarms: [],
  rests: [],
  graph: CANARY,
  graph_name: CANARY,
  version: CANARY,
  detail: CANARY,
  cause: CANARY,
  note: CANARY,
  labels: [CANARY],
  log: [{ at: "2026-11-20T08:00:01Z", text: CANARY }],
  actions: { [`${CANARY}_0`]: { aid: "a", state: "RUNNING", visits: [], older: 0, messages: [] } },
  umrf: { graph_name: CANARY, actions: [] },
};

let root: Root;
let place: HTMLElement;

beforeEach(() => {
  place = document.body.appendChild(document.createElement("div"));
  root = createRoot(place);
});
afterEach(async () => {
  await act(async () => root.unmount());
  place.remove();
});

/** Draw the page of a run, and return its texts and buttons. */
async function shown(part: object): Promise<{ text: string; buttons: string[]; links: number }> {
  const client = new QueryClient({ defaultOptions: { queries: { retry: false, staleTime: 1e9 } } });
  client.setQueryData(["people"], []);
  client.setQueryData(["runs", "one", "r"], { ...run, ...part } as unknown as Run);
  await act(async () =>
    root.render(
      <MantineProvider>
        <QueryClientProvider client={client}>
          <PersonContext value={adaAs("viewer")}>
            <RunPage
              id="r"
              bar={({ crumbs, status, actions }) => (
                <header>
                  {crumbs.map(({ label }) => label).join(" / ")} {status} {actions}
                </header>
              )}
              start={() => null}
            />
          </PersonContext>
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  const buttons = [...place.querySelectorAll("button")].map((each) => each.textContent ?? "");
  const links = place.querySelectorAll("a, canvas, [role=tab], input").length;
  return { text: place.innerHTML, buttons, links };
}

test("of a run that is hidden the page shows robot, state, who started it and Stop", async () => {
  const { text, buttons, links } = await shown({});
  for (const word of ["Run 7", "David", "running", "Mari", "that you may not see"]) {
    expect(plain(text)).toContain(word);
  }
  expect(text).not.toContain(CANARY);
  expect([buttons.map(plain), links]).toEqual([["Stop David"], 0]);
});

test("after its end it shows who stopped it, the proof, and nothing to press", async () => {
  const { text, buttons } = await shown({
    state: "stopped",
    desired: "stopped",
    stopped_by: { id: "q", name: "Jan" },
    ended_at: "2026-11-20T08:01:00Z",
    proof_at: "2026-11-20T08:01:00Z",
  });
  expect(plain(text)).toContain("Stopped by Jan");
  expect(text).toContain("proved at");
  expect(text).not.toContain(CANARY);
  expect(buttons).toEqual([]);
});
