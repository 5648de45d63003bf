// @vitest-environment jsdom
import { act } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, expect, test, vi } from "vitest";
import type { LiveLink, LiveState } from "../../api/live-socket";
import { StopButton } from "./stop-button";
import { graphOnScreen } from "./stop-surroundings";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
const page = vi.hoisted(() => ({ now: {} as object, stop: vi.fn() }));
vi.mock("../../api/page-link", () => ({ useLive: () => ({ live: page, now: page.now }) }));

const run = { id: "a", number: 1, graph: "g", graph_name: "patrol", engine: "Carl", group: null };
const state = (link: LiveLink, ...runs: object[]): LiveState =>
  ({
    ...{ link, since: 0, engines: [], stops: [], asked: [] },
    runs: new Map(runs.map((each) => ["a", { ...run, ended_at: null, ...each }])),
  }) as unknown as LiveState;
const site = (name: string, of: LiveState) => ({
  site: { name, url: `http://${name}` },
  state: of,
});

/** Draws STOP on the page of a graph with one run, and returns the button for everything. */
function buttonForAll(now: LiveState): HTMLButtonElement | undefined {
  page.now = now;
  graphOnScreen.set("g");
  const root = document.body.appendChild(document.createElement("div"));
  act(() => createRoot(root).render(<StopButton />));
  const buttons = [...root.querySelectorAll("button")];
  return buttons.find(({ textContent }) => textContent?.startsWith("Stop everything"));
}

afterEach(() => document.body.replaceChildren());

test("beside Stop of the run on screen, everything can be stopped while another runner is silent", () => {
  const live = state("live", {});
  expect(buttonForAll(live)).toBeUndefined();
  const silent = { ...live, sites: [site("A", live), site("B", state("down"))] };
  const button = buttonForAll(silent);
  expect(button?.textContent).toContain("ALL ?");
  button?.click();
  expect(page.stop).toHaveBeenCalledWith("all");
  const both = { ...live, sites: [site("A", live), site("B", state("live"))] };
  expect(buttonForAll(both)).toBeUndefined();
});
