// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, expect, test, vi } from "vitest";
import { PersonContext, type SignedIn } from "../api/people";
import { standInForBrowser } from "../testing/browser";
import { AccountPanel } from "./account-panel";

standInForBrowser();

const link = vi.hoisted(() => ({ isStopping: false }));
vi.mock("../api/page-link", () => ({
  useLive: () => ({ runner: "http://runner", live: link, now: { runs: new Map() } }),
}));

let root: Root;
let deleted: string[];
let answers: boolean;

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
});

/** Opens the panel; returns what presses Sign out. */
async function opened(): Promise<() => Promise<void>> {
  deleted = [];
  answers = true;
  vi.stubGlobal("fetch", (url: string, { method }: RequestInit) => {
    if (method === "DELETE") deleted.push(url);
    if (!answers) return Promise.reject(new TypeError("no answer"));
    return new Promise(() => undefined); // not yet
  });
  const person = { person: { id: "a", name: "Ada", role: "viewer", personal: true } };
  root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <PersonContext value={person as SignedIn}>
          <QueryClientProvider client={new QueryClient()}>
            <AccountPanel onShare={null} onClose={() => {}} onLeave={async () => {}} />
          </QueryClientProvider>
        </PersonContext>
      </MantineProvider>,
    ),
  );
  const button = [...document.querySelectorAll("button")].find(
    ({ textContent }) => textContent === "Sign out",
  );
  return () => act(async () => button?.click());
}

test("signing out ends the session at once", async () => {
  const signOut = await opened();
  await signOut();
  expect(deleted).toHaveLength(2);
});

test("while a STOP ALL is not proven, signing out says first that it would be sent no more", async () => {
  link.isStopping = true;
  const signOut = await opened();
  await signOut();
  expect(deleted).toEqual([]);
  expect(document.querySelector("[role=alert]")?.textContent).toContain("A Stop is not proven");
  await signOut();
  expect(deleted).toHaveLength(2);
});

test("who could not sign out before is told, too, that a STOP ALL is not proven", async () => {
  link.isStopping = false;
  const signOut = await opened();
  answers = false;
  await signOut();
  const said = () => document.querySelector("[role=alert]")?.textContent;
  await vi.waitFor(() => expect(said()).toContain("could not end this session"));
  link.isStopping = true;
  deleted = [];
  await signOut();
  expect(deleted).toEqual([]);
  expect(said()).toContain("A Stop is not proven");
  await signOut();
  expect(deleted).toHaveLength(2);
});
