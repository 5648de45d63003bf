// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test } from "vitest";
import { PersonContext, type SignedIn } from "../api/people";
import type { Run } from "../api/runs";
import { standInForBrowser } from "../testing/browser";
import { NoteHere } from "./run-notes";

standInForBrowser();

/** Opens the field for a note as this person; returns what it says, and types a text where one is given. */
function noteOf(person: string, text?: string): string | undefined {
  const run = { id: "r", requested_at: "2026-11-30T08:00:00Z", started_at: null, ended_at: null };
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider env="test">
        <PersonContext value={{ person: { id: person } } as SignedIn}>
          <QueryClientProvider client={new QueryClient()}>
            <NoteHere runner="http://runner" run={run as unknown as Run} at={null} />
          </QueryClientProvider>
        </PersonContext>
      </MantineProvider>,
    ),
  );
  act(() => document.querySelector("button")?.click());
  const field = document.querySelector("textarea");
  const was = field?.value;
  const { set } = Object.getOwnPropertyDescriptor(HTMLTextAreaElement.prototype, "value") ?? {};
  if (text !== undefined)
    act(() => {
      set?.call(field, text);
      field?.dispatchEvent(new Event("input", { bubbles: true }));
    });
  act(() => root.unmount());
  return was;
}

test("a half-written note is there again for the person who wrote it, and for nobody else", () => {
  expect(noteOf("ada", "the gripper")).toBe("");
  expect(noteOf("bob")).toBe("");
  expect(noteOf("ada")).toBe("the gripper");
});
