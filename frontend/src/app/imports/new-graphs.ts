/** New graphs and actions: from nothing, and from files. */
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useCallback } from "react";
import { useLocation, useSearch } from "wouter";
import { fetchGraphNames } from "../../api/graph-names";
import { createGraph, refreshGraphs, refreshLibrary } from "../../api/graphs";
import { errorText } from "../../api/http";

function complain(title: string, error: unknown): void {
  notifications.show({ color: "red", title, message: errorText(error), autoClose: 15_000 });
}

/** Asks for files as a file input does; nothing of it stays in the page. */
function chooseFiles(): Promise<File[]> {
  return new Promise((resolve) => {
    const input = document.createElement("input");
    input.type = "file";
    input.accept = ".json,application/json";
    input.multiple = true;
    input.onchange = () => resolve([...(input.files ?? [])]);
    input.oncancel = () => resolve([]);
    input.click();
  });
}

/** Return the first of "task_1", "task_2" … that no graph is called. */
export function freshName(taken: readonly string[]): string {
  for (let n = 1; ; n += 1) if (!taken.includes(`task_${n}`)) return `task_${n}`;
}

export interface NewGraphs {
  create: () => void;
  choose: () => void;
  take: (files: readonly File[]) => Promise<void>;
}

export function useNewGraphs(): NewGraphs {
  const client = useQueryClient();
  const [path, go] = useLocation();
  const search = useSearch();
  // The folder on screen, as the page of graphs has it in its address.
  const folder = path === "/" ? new URLSearchParams(search).get("folder") : null;
  const create = useCallback(async () => {
    try {
      const known = await fetchGraphNames(client);
      const graph = await createGraph(freshName(known.map(({ name }) => name)), folder);
      void refreshGraphs(client);
      go(`/graphs/${graph.id}`);
    } catch (error) {
      complain("No new graph", error);
    }
  }, [client, go, folder]);
  const take = useCallback(
    async (files: readonly File[]) => {
      if (files.length === 0) return;
      const after = () => void Promise.all([refreshGraphs(client), refreshLibrary(client)]);
      try {
        const [{ takeFiles }, { placeAfter, progressOf, tellTaken }] = await Promise.all([
          import("./take-files"),
          import("./take-files"),
        ]);
        const { tell, end } = progressOf(files.length);
        const found = await takeFiles(files, tell, folder).finally(end);
        after();
        tellTaken(found, after);
        const place = placeAfter(found);
        if (place !== null) go(place);
      } catch (error) {
        complain("Nothing was imported", error);
      }
    },
    [client, go, folder],
  );
  const choose = useCallback(async () => take(await chooseFiles()), [take]);
  return { create: () => void create(), choose: () => void choose(), take };
}
