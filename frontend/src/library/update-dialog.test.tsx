// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { standInForBrowser } from "../testing/browser";
import { UpdateDialog } from "./update-dialog";

standInForBrowser();

const WHY = "Others have changed this 5 times; try again.";

test("a graph whose update failed is named with its reason, beside those that are updated", async () => {
  const use = { seq: 1, count: 1, changed: true, suggested: { inputs: [], outputs: [] } };
  const uses = [
    { ...use, graph: "one", name: "Round" },
    { ...use, graph: "two", name: "Patrol" },
  ];
  const updated = [
    { graph: "one", seq: 2, changed: true, refused: "" },
    { graph: "two", seq: 1, changed: false, refused: WHY },
  ];
  vi.stubGlobal("fetch", async (_: unknown, init?: RequestInit) =>
    Response.json(init?.method === "POST" ? updated : { seq: 3, uses }),
  );
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>
          <UpdateDialog id="a" name="Lift" mayEdit opened onClose={() => {}} />
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  const press = () =>
    [...document.querySelectorAll("button")].find((each) => each.textContent === "Update 2 graphs");
  await act(() => vi.waitFor(() => expect(press()?.disabled).toBe(false)));
  await act(async () => press()?.click());
  const alert = () => document.querySelector("[role=alert]")?.textContent;
  await act(() =>
    vi.waitFor(() => expect(alert()).toBe(`The update of 1 graph failed:Patrol${WHY}`)),
  );
  const status = document.querySelector("section[role=status]")?.textContent;
  expect(status).toContain("1 graph is updated and saved");
  act(() => root.unmount());
});
