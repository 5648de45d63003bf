/** New graphs: from nothing, and from files. */
import { notifications } from "@mantine/notifications";
import { useQueryClient } from "@tanstack/react-query";
import { useCallback } from "react";
import { useLocation } from "wouter";
import {
  createGraph,
  type GraphSummary,
  importGraph,
  previewGraph,
  queryKeys,
  refreshGraphs,
} from "../api/graphs";
import { errorPlace, errorText } from "../api/http";
import { importReviews, isPlain } from "./import-review";

const MOST_BYTES = 10 * 1024 * 1024;

function complain(title: string, error: unknown): void {
  const where = errorPlace(error);
  notifications.show({
    color: "red",
    title,
    message: where === "" ? errorText(error) : `${errorText(error)} (${where})`,
    autoClose: 15_000,
  });
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

/** "task_1", "task_2" …: the first that no graph is called. A name that can be said and found. */
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
  const [, go] = useLocation();
  const create = useCallback(async () => {
    try {
      const known = client.getQueryData<readonly GraphSummary[]>(queryKeys.graphs) ?? [];
      const graph = await createGraph(freshName(known.map(({ name }) => name)));
      void refreshGraphs(client);
      go(`/graphs/${graph.id}`);
    } catch (error) {
      complain("No new graph", error);
    }
  }, [client, go]);
  const take = useCallback(
    async (files: readonly File[]) => {
      let last: GraphSummary | null = null;
      for (const file of files) {
        try {
          if (file.size > MOST_BYTES) throw new Error("The file is larger than 10 MB.");
          const text = await file.text();
          const preview = await previewGraph(text);
          if (!isPlain(preview) && !(await importReviews.ask(file.name, preview))) continue;
          last = await importGraph(text);
        } catch (error) {
          complain(`${file.name} was not imported`, error);
        }
      }
      if (last === null) return;
      void refreshGraphs(client);
      go(`/graphs/${last.id}`);
    },
    [client, go],
  );
  const choose = useCallback(async () => take(await chooseFiles()), [take]);
  return { create: () => void create(), choose: () => void choose(), take };
}
