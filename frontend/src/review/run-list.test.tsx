// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PersonContext, type SignedIn } from "../api/people";
import { type SiteRouter, setSiteRouter, setSites } from "../api/sites";
import { serverNow } from "../clock/server-clock";
import { standInForBrowser } from "../testing/browser";
import { RunList, type RunOfList } from "./run-list";

standInForBrowser();

const MINUTE = 60_000;
const A = { name: "Hall A", url: "http://a" };
const B = { name: "Hall B", url: "http://b" };

beforeEach(() => {
  vi.useFakeTimers({ toFake: ["performance"] }); // no time goes by
});

afterEach(() => {
  vi.useRealTimers();
  setSiteRouter(undefined);
  setSites([]);
});

/** A run of one minute, of which an action ran in the second half, by the clock of its runner. */
function runSince(begin: number): RunOfList {
  const at = (ms: number) => new Date(ms).toISOString();
  const half = at(begin + MINUTE / 2 + 500);
  const visit = { from: half, not_before: half, until: null, not_after: null, result: null };
  return {
    ...{
      id: "r",
      number: 1,
      graph: "g",
      graph_name: "walk",
      version: "v",
      digest: "d",
      engine: "Dora",
    },
    ...{ state: "running", desired: "running", ended_at: null, unknown_since: null, alarms: [] },
    ...{ requested_at: at(begin), started_at: at(begin), author: { id: "a", name: "Ada" } },
    actions: { Walk_0: { aid: "a", state: "RUNNING", count: 1, older: 0, visits: [visit] } },
  } as unknown as RunOfList;
}

/** Show runs in the list, of which some are chosen to be compared. Returns how to take it away. */
async function show(runs: readonly RunOfList[], chosen: readonly string[] = []) {
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <PersonContext value={{ person: { id: "a", name: "Ada" } } as SignedIn}>
          <QueryClientProvider client={new QueryClient()}>
            <RunList runs={runs} chosen={chosen} onChoose={() => {}} isGapless goesOn={false} />
          </QueryClientProvider>
        </PersonContext>
      </MantineProvider>,
    ),
  );
  return () => act(() => root.unmount());
}

test("a run at a site whose clock is ahead has its course and its time by that clock", async () => {
  vi.stubGlobal("fetch", () => new Promise(() => undefined));
  setSites([A, B]);
  setSiteRouter({ siteOfId: () => B, shiftOf: () => -MINUTE } as unknown as SiteRouter);
  const present = serverNow() + MINUTE; // by the clock of the site
  const run = runSince(present - MINUTE);
  const leave = await show([run]);
  const course = [...document.querySelectorAll<HTMLElement>("[role=img] > *")];
  const parts = course.map(({ dataset, style }) => [dataset.tone, Number(style.flexGrow)]);
  expect(parts).toEqual([
    ["idle", 30],
    ["run", 30],
  ]);
  expect(document.body.textContent).toContain("1:00");
  leave();
});

test("while a run is chosen, the list says once why those of another site cannot be", async () => {
  vi.stubGlobal("fetch", () => new Promise(() => undefined));
  setSites([A, B]);
  const siteOfId = (id: string) => (id === "r" ? A : B);
  setSiteRouter({ siteOfId, shiftOf: () => 0 } as unknown as SiteRouter);
  const run = runSince(serverNow() - MINUTE);
  const runs = [run, { ...run, id: "s", number: 2 }, { ...run, id: "t", number: 3 }];
  const leave = await show(runs, ["r"]);
  expect(document.querySelector("[role=status]")?.textContent).toMatch(/^Only runs of .*Hall A/);
  const boxes = [...document.querySelectorAll<HTMLInputElement>("[type=checkbox]")];
  const reasons = boxes.map((box) => box.getAttribute("aria-describedby") ?? "");
  const [, one, two] = reasons.map((id) => id && document.getElementById(id)?.textContent);
  expect(reasons[0]).toBe("");
  expect([one, two]).toEqual([one, expect.stringContaining("Hall A")]);
  expect(boxes.map(({ disabled }) => disabled)).toEqual([false, true, true]);
  leave();
});
