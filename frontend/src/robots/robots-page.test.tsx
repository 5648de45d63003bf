// @vitest-environment jsdom

import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act, type ReactNode } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PersonContext } from "../api/people";
import { startPracticeRobot } from "../api/robots";
import { setKnowledge, siteRouter } from "../api/site-requests";
import { setSiteRouter, setSites } from "../api/sites";
import { adaAs, standInForBrowser } from "../testing/browser";
import { plain } from "../testing/texts";
import "./robot-form"; // so that its part is there at once
import { RobotsPage } from "./robots-page";

beforeEach(standInForBrowser);

const A = { name: "Hall A", url: "http://a" };
const B = { name: "Hall B", url: "http://b" };
const live = { link: "live", engines: [] };
const page = vi.hoisted(() => ({ now: {} as object }));

vi.mock("../api/page-link", () => ({ useLive: () => ({ runner: A.url, now: page.now }) }));
vi.mock("./robot-card", () => ({
  RobotCard: ({ restartControl }: { restartControl?: ReactNode }) => (
    <article>{restartControl}</article>
  ),
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
  page.now = { ...live, sites: [A, B].map((site) => ({ site, state: live })) };
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

test("a practice robot is started again at its own site, while that answers", async () => {
  setSites([A, B]);
  setSiteRouter(siteRouter);
  let others: readonly string[] = [];
  setKnowledge(({ url }) => {
    const robots = new Set(url === B.url ? ["Practice"] : others);
    return { isLive: true, robots, hasRun: () => false, shift: 0 };
  });
  const posted: string[] = [];
  vi.stubGlobal("fetch", async (url: string, { method }: RequestInit) => {
    if (method === "POST") posted.push(url);
    return Response.json({ no_reach: "", engines: [], left_s: 0 });
  });
  const gone = [{ name: "Practice", simulated: false, practice_ended: true }];
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  const draw = (link: string) => {
    const b = { site: B, state: { link, engines: gone } };
    page.now = { link: "live", engines: gone, sites: [{ site: A, state: live }, b] };
    return act(async () =>
      root.render(
        <MantineProvider env="test" key={link}>
          <QueryClientProvider client={new QueryClient()}>
            <PersonContext value={adaAs("operator")}>
              <RobotsPage onImport={() => {}} />
            </PersonContext>
          </QueryClientProvider>
        </MantineProvider>,
      ),
    );
  };
  const button = () => document.querySelector<HTMLButtonElement>("article button");
  await draw("live");
  await vi.waitFor(() =>
    act(async () => expect(button()?.textContent).toBe("Start the practice robot again")),
  );
  await act(async () => button()?.click());
  await vi.waitFor(() => expect(posted).toEqual([`${B.url}/api/practice`]));
  others = ["Practice"];
  await expect(startPracticeRobot(B.url)).rejects.toThrow("registered at Hall A");
  expect(posted).toHaveLength(1);
  await draw("down");
  await act(async () => new Promise((done) => setTimeout(done)));
  expect(document.querySelector("article")).not.toBeNull();
  expect(button()).toBeNull();
  await act(async () => root.unmount());
});
