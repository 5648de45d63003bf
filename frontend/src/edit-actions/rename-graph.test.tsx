// @vitest-environment jsdom
import { QueryClient, QueryClientProvider } from "@tanstack/react-query";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import * as Y from "yjs";
import { queryKeys } from "../api/graphs";
import { EditorStore, type GraphsInside } from "../canvas/editor-store";
import { setGraphName } from "../graph/edit";
import { graphIn } from "../testing/edited-graph";
import type { EditorContext, Overlay } from "./editor-context";
import { useRenameGraph } from "./rename-graph";

vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);

interface ProbeProps {
  context: EditorContext;
  onRender: (rename: (name: string) => boolean) => void;
}

function Probe({ context, onRender }: ProbeProps) {
  onRender(useRenameGraph(context));
  return null;
}

/** Renames a graph called Lift to `name`, and returns what was asked. */
function renamed(name: string, isNamed: boolean, document: string | null = null) {
  const doc = new Y.Doc();
  setGraphName(doc, "Lift");
  const client = new QueryClient({ defaultOptions: { queries: { staleTime: Infinity } } });
  client.setQueryData(queryKeys.actions, [{ name: "Lift", document, used_in: ["g", "round"] }]);
  const store = new EditorStore();
  store.graphsInside.set({ isNamed } as GraphsInside);
  const asked: (Overlay | null)[] = [];
  const context = {
    doc,
    store,
    id: "g",
    graph: graphIn(doc),
    openOverlay: (overlay: Overlay | null) => asked.push(overlay),
  } as unknown as EditorContext;
  const root = createRoot(window.document.createElement("div"));
  let rename: (name: string) => boolean = () => false;
  const onRender = (given: typeof rename) => {
    rename = given;
  };
  act(() =>
    root.render(
      <QueryClientProvider client={client}>
        <Probe context={context} onRender={onRender} />
      </QueryClientProvider>,
    ),
  );
  act(() => void rename(name));
  act(() => root.unmount());
  return { name: graphIn(doc).name, asked };
}

test("a graph that others run is renamed at once, and whether they follow is asked", () => {
  expect(renamed("LiftSafely", true)).toEqual({
    name: "LiftSafely",
    asked: [{ kind: "renamed", before: "Lift", name: "LiftSafely", uses: ["round"] }],
  });
});

test("no question is asked where the name stands for another graph or an action, or has not changed", () => {
  expect(renamed("LiftSafely", false)).toEqual({ name: "LiftSafely", asked: [] });
  expect(renamed("LiftSafely", true, "library")).toEqual({ name: "LiftSafely", asked: [] });
  expect(renamed("Lift", true)).toEqual({ name: "Lift", asked: [] });
});
