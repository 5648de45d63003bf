// @vitest-environment jsdom

import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { plain } from "../testing/texts";
import { AskedLine } from "./asked-line";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

const asking = (id: string, number: number) =>
  [id, { id, number, ended_at: null, questions: [{ id: `q-${id}`, text: `${id}?` }] }] as const;

vi.mock("../api/page-link", () => ({
  useLive: () => ({
    runner: "http://runner",
    now: { runs: new Map([asking("a", 2), asking("b", 1)]) },
  }),
}));

/** What the line says on the page of this address; null without one. */
function lineAt(address: string, below: boolean): string | null {
  window.history.pushState(null, "", address);
  const client = new QueryClient();
  const questions = ["q-a", "q-b"].map((id) => ({ question: { id }, may: true }));
  client.setQueryData(["questions", "http://runner", "q-a q-b"], { questions });
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <QueryClientProvider client={client}>
        <AskedLine below={below} />
      </QueryClientProvider>,
    ),
  );
  const label = document.querySelector("a")?.getAttribute("aria-label") ?? null;
  act(() => root.unmount());
  return label === null ? null : plain(label);
}

test("below the bar of the page of a run, the questions of other runs are shown", () => {
  expect(lineAt("/runs/a", true)).toBe("Run 1 asks: b?");
  expect(lineAt("/runs/b", true)).toBe("Run 2 asks: a?");
  expect(lineAt("/graphs", true)).toBe("Run 2 asks: a? and 1 more");
  expect(lineAt("/runs/a", false)).toBe("Run 2 asks: a? and 1 more");
});
