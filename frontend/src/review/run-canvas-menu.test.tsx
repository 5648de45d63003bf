// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { Run } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import { standInForBrowser } from "../testing/browser";
import { RunCanvasMenu } from "./run-canvas-menu";

standInForBrowser();

const graph = fromUmrf({ graph_name: "g", actions: [{ name: "Work", instance_id: 0 }] });

let root: Root;

beforeEach(() => {
  vi.stubGlobal("fetch", () => new Promise(() => {})); // nobody answers
  root = createRoot(document.body.appendChild(document.createElement("div")));
});

afterEach(() => {
  act(() => root.unmount());
  vi.unstubAllGlobals();
  document.body.replaceChildren();
});

/** Draws the menu of an ended run; `levels`: the sub-graphs around its action. */
async function draw(levels: readonly string[] | undefined): Promise<string> {
  const run = {
    ...{ id: "r", number: 1, graph: "g", graph_name: "g", version: "v", robots: {} },
    ...{ ended_at: "2026-11-30T08:00:00Z", actions: { Work_0: levels ? { levels } : {} } },
  } as unknown as Run;
  const client = new QueryClient({ defaultOptions: { queries: { enabled: false } } });
  const place = { id: graph.actions[0]?.key ?? "", screen: [0, 0] as const };
  await act(async () => {
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={client}>
          <RunCanvasMenu
            {...{ run, graph, place, engines: [] }}
            onStart={() => {}}
            onClose={() => {}}
          />
        </QueryClientProvider>
      </MantineProvider>,
    );
  });
  return document.body.textContent ?? "";
}

test("a menu that stayed open as an opened run ended offers no run from an action inside", async () => {
  expect(await draw(undefined)).toContain("Run from");
  expect(await draw(["Pick_0"])).not.toContain("Run from");
});
