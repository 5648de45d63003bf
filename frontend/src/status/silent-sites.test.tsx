// @vitest-environment jsdom

import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { QueuePage } from "../review/queue-page";
import { plain } from "../testing/texts";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
const mocked = vi.hoisted(() => ({ link: "live" }));

vi.mock("../api/page-link", () => ({
  useLive: () => ({
    runner: "http://a",
    now: {
      link: "live",
      sites: [
        { site: { name: "Hall A", url: "http://a" }, state: { link: "live" } },
        { site: { name: "Hall B", url: "http://b" }, state: { link: mocked.link } },
      ],
    },
  }),
}));

vi.mock("../ui/empty", () => ({ Empty: ({ title }: { title: string }) => <h3>{title}</h3> }));

/** What the page of an empty queue says. */
function said(): string {
  const client = new QueryClient();
  client.setQueryData(["queue", 0], { entries: [], robots: [] });
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <QueryClientProvider client={client}>
        <QueuePage bar={() => null} />
      </QueryClientProvider>,
    ),
  );
  const text = document.body.textContent ?? "";
  act(() => root.unmount());
  return plain(text);
}

test("a queue of which one site says nothing is not called empty", () => {
  vi.stubGlobal("fetch", () => new Promise(() => undefined));
  expect(said()).toContain("Nothing waits");
  mocked.link = "down";
  expect(said()).toContain("Hall B does not answer: what waits there is not known.");
  expect(said()).not.toContain("Nothing waits");
});
