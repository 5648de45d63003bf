// @vitest-environment jsdom

import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, expect, test, vi } from "vitest";
import { PersonContext } from "../api/people";
import { setKnowledge, siteRouter } from "../api/site-requests";
import { setSiteRouter, setSites } from "../api/sites";
import { adaAs, standInForBrowser } from "../testing/browser";
import { plain } from "../testing/texts";
import "./robot-form"; // so that its part is there at once
import { RobotsPage } from "./robots-page";

standInForBrowser();

const A = { name: "Hall A", url: "http://a" };
const B = { name: "Hall B", url: "http://b" };
const live = { link: "live", engines: [] };

vi.mock("../api/page-link", () => ({
  useLive: () => ({
    runner: A.url,
    now: { ...live, sites: [A, B].map((site) => ({ site, state: live })) },
  }),
}));

const FOUND = { actor: "Dora", domain: 42, get_service: "get", generation: "", problem: "" };

afterEach(() => {
  setSiteRouter(undefined);
  setSites([]);
  vi.unstubAllGlobals();
});

test("an engine is registered at the runner that has found it", async () => {
  setSites([A, B]);
  setSiteRouter(siteRouter);
  setKnowledge(() => ({ isLive: true, robots: new Set(), hasRun: () => false, shift: 0 }));
  const posted: string[] = [];
  vi.stubGlobal("fetch", async (url: string, { method }: RequestInit) => {
    if (method === "POST") posted.push(url);
    if (url.endsWith("/api/reach")) return Response.json({ no_reach: "", engines: [] });
    if (url.endsWith("/api/candidates/now"))
      return Response.json({ engines: url.startsWith(B.url) ? [FOUND] : [], left_s: 0 });
    return Response.json({});
  });
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>
          <PersonContext value={adaAs("operator")}>
            <RobotsPage onImport={() => {}} />
          </PersonContext>
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  const found = () => document.querySelector("section[aria-label]");
  await vi.waitFor(() => act(async () => expect(found()?.textContent).toContain("Dora")));
  expect(plain(found()?.getAttribute("aria-label"))).toBe("In sight of Hall B, not registered");
  await act(async () => found()?.querySelector("button")?.click());
  const site = () => document.querySelector<HTMLSelectElement>("[role=dialog] select");
  await vi.waitFor(() => act(async () => expect(site()?.value).toBe(B.url)));
  await act(async () => document.querySelector("form")?.requestSubmit());
  await vi.waitFor(() => expect(posted).toEqual([`${B.url}/api/robots`]));
  await act(async () => root.unmount());
});
