// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { PersonContext } from "../api/people";
import type { QueueEntry } from "../api/queue";
import { adaAs, standInForBrowser } from "../testing/browser";
import { QueuePage } from "./queue-page";

standInForBrowser();

vi.mock("../api/page-link", () => ({
  useLive: () => ({ runner: "http://runner", now: { engines: [], runs: new Map() } }),
}));

const OBSTACLE = "What is stored of it cannot be read any more. It can only be removed.";
const UNREAD = "a start that cannot be read";
const entry = (part: Partial<QueueEntry>): QueueEntry => ({
  ...{ id: "e", graph: "g", graph_name: "lift", version: "v", digest: "d", engine: "simulator" },
  ...{ robots: [], values: {}, author: { id: "b", name: "Ben" }, by_itself: false },
  ...{ entered_at: "2026-11-30T08:00:00Z", state: "ready", waits: [], differs: [] },
  ...{ ready_at: null, hidden: false, obstacle: "" },
  ...part,
});

/** What each entry of the queue says, and the buttons in it. */
async function shown(...entries: QueueEntry[]): Promise<{ text: string; buttons: string[] }[]> {
  vi.stubGlobal("fetch", () => new Promise(() => undefined));
  const client = new QueryClient();
  client.setQueryData(["queue", 0], { entries, robots: [] });
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={client}>
          <PersonContext value={adaAs("owner")}>
            <QueuePage bar={() => null} />
          </PersonContext>
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  const found = [...document.querySelectorAll("li")].map((line) => ({
    text: line.textContent ?? "",
    buttons: [...line.querySelectorAll("button")].map((each) => each.textContent ?? ""),
  }));
  act(() => root.unmount());
  return found;
}

test("a stored start that can only be removed says why, and offers nothing else", async () => {
  const [readable] = await shown(entry({}));
  expect(readable?.text).toContain("Its turn: a person looks, and starts it.");
  expect(readable?.buttons).toEqual(["Look before the start", "Remove"]);
  const [broken] = await shown(
    entry({ obstacle: OBSTACLE, graph: null, graph_name: UNREAD, engine: "" }),
  );
  expect(broken?.text).toContain(OBSTACLE);
  expect(broken?.text).not.toContain("Its turn");
  expect(broken?.buttons).toEqual(["Remove"]);
});
