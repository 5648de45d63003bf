// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { pageLink } from "../api/page-link";
import { standInForBrowser } from "../testing/browser";
import { Wire } from "../testing/wire";
import { SignInGate } from "./sign-in-gate";

standInForBrowser();

test("who has a session and opens an invitation has STOP, also where the device stores nothing", async () => {
  vi.stubGlobal("WebSocket", Wire);
  vi.stubGlobal("localStorage", {
    getItem: () => null,
    removeItem: () => {},
    setItem: () => {
      throw new DOMException("full", "QuotaExceededError");
    },
  });
  location.hash = "#i=ID.SECRET";
  const answers: Record<string, object> = {
    "/api/session/invitation": { role: "viewer", inviter: "Ben", name: "", known: false },
    "/api/session": { person: { id: "a", name: "Ada", role: "viewer" }, personal: false },
    "/api/config": { runner_url: "http://h:1" },
  };
  vi.stubGlobal("fetch", async (url: string) =>
    Response.json(Object.entries(answers).find(([path]) => url.endsWith(path))?.[1] ?? {}),
  );
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>
          <SignInGate>inside</SignInGate>
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  await vi.waitFor(() => act(async () => expect(pageLink.now().signedIn).toBe(true)));
  expect(document.body.textContent).not.toContain("inside");
  await act(async () => root.unmount());
  vi.unstubAllGlobals();
});
