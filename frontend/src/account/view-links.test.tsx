// @vitest-environment jsdom

import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { setKnowledge, siteRouter } from "../api/site-requests";
import { type Site, setSiteRouter, setSites } from "../api/sites";
import { standInForBrowser } from "../testing/browser";
import { plain } from "../testing/texts";
import { ViewLinks } from "./view-links";

standInForBrowser();

const A: Site = { name: "Hall A", url: "http://a" };
const B: Site = { name: "Hall B", url: "http://b" };

vi.mock("../api/page-link", () => ({
  useLive: () => ({
    runner: "http://a",
    now: { sites: [A, B].map((site) => ({ site, state: { link: "live" } })) },
  }),
}));

beforeEach(() => {
  setSites([A, B]);
  setKnowledge((site) => ({
    isLive: true,
    robots: new Set(),
    hasRun: (id) => site === A && id === "ofA",
    shift: 0,
  }));
  setSiteRouter(siteRouter);
  vi.stubGlobal("fetch", async (url: string) =>
    url.startsWith(B.url) ? new Response("broken", { status: 500 }) : Response.json([]),
  );
});

afterEach(() => {
  setSiteRouter(undefined);
  setSites([]);
});

/** What the links to a run say as soon as each site has answered. */
async function shown(run: string): Promise<string> {
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>
          <ViewLinks thing={{ kind: "run", id: run }} origin="http://page" />
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  await act(async () => {});
  const text = [...document.querySelectorAll("[role=status]")].map(
    ({ textContent }) => textContent,
  );
  act(() => root.unmount());
  return plain(text.join(" "));
}

test("the links to a run name a site that may have some and gives no usable answer", async () => {
  expect(await shown("else")).toBe(
    "The runner of Hall B gives no usable answer (The server answered 500): links to this run may be missing here.",
  );
  expect(await shown("ofA")).toBe("");
});
