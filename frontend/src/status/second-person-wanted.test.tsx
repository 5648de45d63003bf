// @vitest-environment jsdom

import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { PersonContext } from "../api/people";
import type { ApprovalWanted } from "../api/starts";
import { standInForBrowser } from "../testing/browser";
import { plain } from "../testing/texts";
import { WantedYes } from "./second-person";

standInForBrowser();

vi.mock("../api/page-link", () => ({ useLive: () => ({ runner: "http://runner", now: {} }) }));

const WHY = "You may not see all graphs of this start, so you cannot say yes to it.";
const ben = {
  person: { id: "b", name: "Ben", role: "operator" as const },
  visit: 0,
  rename: async () => {},
};

/** A question of Ada as the runner answers it. */
const asked = (part: Partial<ApprovalWanted>): ApprovalWanted => ({
  author: { id: "a", name: "Ada" },
  at: "2026-11-30T08:00:00Z",
  robots: ["David"],
  ...{ digest: "", tree_digest: "", version: "", values: {}, order: [], hidden: "" },
  ...part,
});

/** What Ben reads under the start of a graph, and what he can press there. */
async function shown(...questions: ApprovalWanted[]): Promise<{ texts: string[]; says: string[] }> {
  vi.stubGlobal("fetch", async (input: string | Request) => {
    const { pathname } = new URL(typeof input === "string" ? input : input.url, "http://page");
    return Response.json(pathname === "/api/approvals/asked" ? questions : []);
  });
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  await act(async () =>
    root.render(
      <MantineProvider env="test">
        <QueryClientProvider client={new QueryClient()}>
          <PersonContext value={ben}>
            <WantedYes graph="g" looks={undefined} />
          </PersonContext>
        </QueryClientProvider>
      </MantineProvider>,
    ),
  );
  const all = (tag: string) => [...document.querySelectorAll(tag)];
  const inSight = questions.filter(({ hidden }) => hidden === "");
  await act(async () => {
    await vi.waitFor(() => expect(all("section")).toHaveLength(questions.length));
    await vi.waitFor(() => expect(all("button")).toHaveLength(inSight.length));
  });
  const textsOf = (name: string) => all(name).map(({ textContent }) => plain(textContent));
  const found = { texts: textsOf("section"), says: textsOf("button") };
  act(() => root.unmount());
  return found;
}

test("a start that a person may not see names who asks, the robots and why, and offers no yes", async () => {
  const { texts, says } = await shown(asked({ hidden: WHY }));
  expect(texts).toEqual([`Ada asks others for their yes, for David. ${WHY}`]);
  expect(says).toEqual([]);
});

test("two hidden starts are two, and one in sight beside them is said yes to", async () => {
  const order = [{ what: "Limit", text: "torque at most 60" }];
  const { texts, says } = await shown(
    asked({ hidden: WHY }),
    asked({ hidden: WHY, at: "2026-11-30T09:00:00Z" }),
    asked({ digest: "d", order }),
  );
  expect(texts.filter((text) => text.endsWith(WHY))).toHaveLength(2);
  expect(texts[2]).toContain("torque at most 60");
  expect(says).toEqual(["Say yes to exactly this, for Ada to start it"]);
});
