/** Links from runs to what other programs recorded of them: videos, bags. */
import { useQuery } from "@tanstack/react-query";
import { editor } from "../api/client";
import { enginesOf } from "../api/led-runs";
import type { Run } from "../api/runs";
import type { EditorApi } from "../api/schema/editor";
import { serverNow } from "../clock/server-clock";
import { instant } from "../ui/times";

export type RunLink = EditorApi["RunLink"];

const NONE: readonly RunLink[] = [];

/** Return the links that the setting of the server names. */
export function useRunLinks(): readonly RunLink[] {
  const config = useQuery({
    queryKey: ["config"],
    queryFn: ({ signal }) => editor.get("/api/config", { signal }),
    staleTime: Number.POSITIVE_INFINITY,
  });
  return config.data?.run_links ?? NONE;
}

/**
 * Return the address of a recording for each robot of a run; none for a run that moved no robot or has not
 * begun. `at`: the moment that is shown, ms; null for the end, or now.
 */
export function recordedUrls(
  run: Run,
  url: string,
  at: number | null,
): { robot: string; href: string }[] {
  const from = instant(run.started_at);
  if (run.simulated || from === null) return [];
  const to = instant(run.ended_at) ?? serverNow();
  const moments = { from, to, at: at ?? to };
  return enginesOf(run).map((robot) => {
    const places = new Map<string, string>([
      ["robot", robot],
      ["run", run.id],
      ...Object.entries(moments).flatMap(([name, ms]): [string, string][] => [
        [name, new Date(ms).toISOString()],
        [`${name}_ms`, String(Math.round(ms))],
      ]),
    ]);
    const filled = url.replace(/\{(\w+)\}/g, (_, place) =>
      encodeURIComponent(places.get(place) ?? ""),
    );
    return { robot, href: filled };
  });
}
