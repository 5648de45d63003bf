/** State of both processes, and findings of `doctor`: for owners. */

import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, runnerAt } from "../api/client";
import type { EditorApi } from "../api/schema/editor";
import { tick } from "../clock/server-clock";

export type ProcessStatus = EditorApi["ProcessStatus"];
export type Backups = EditorApi["BackupsShown"];
/** One thing that was looked at; `remedy` says what mends it. */
export type Finding = EditorApi["Diagnostic"];

const EACH_MS = 5_000;

/** Query the state of a process again and again. `at`: the address at which it answers, "" for the editor. */
export function useStatus(name: string, at: string | undefined) {
  return useQuery({
    queryKey: ["status", name, at],
    queryFn: ({ signal }) => runnerAt(at).get("/api/status", { signal, timeoutMs: 6_000 }), // the editor has it too
    enabled: at !== undefined,
    refetchInterval: EACH_MS,
    retry: false,
  });
}

export type LastExamination = EditorApi["LastExamination"];

const LAST = ["doctor", "last"];

async function examined(look: boolean, signal?: AbortSignal) {
  const request = { query: { look: look || undefined }, signal, timeoutMs: 10_000 };
  return { last: await editor.get("/api/doctor/last", request), heardAt: tick() };
}

/**
 * Query the last examination, and how long a new one has been running. An examination takes seconds
 * and starts programs, so it runs only when a person asks.
 */
export function useExamination() {
  const client = useQueryClient();
  const query = useQuery({
    queryKey: LAST,
    queryFn: ({ signal }) => examined(false, signal),
    refetchInterval: ({ state }) => (state.data?.last.running_s == null ? false : 1_000),
    retry: false,
  });
  const look = useMutation({
    mutationFn: () => examined(true),
    onSuccess: (begun) => client.setQueryData(LAST, begun),
  });
  return {
    last: query.data?.last,
    /** The tick at which that was heard. */
    heardAt: query.data?.heardAt ?? 0,
    error: query.error ?? look.error,
    look: look.mutate,
  };
}

const UNITS = ["bytes", "kB", "MB", "GB", "TB"] as const;

/** Return a size of bytes in words, as `714 kB` or `1.4 GB`, by steps of 1000. */
export function bytes(count: number): string {
  let value = count;
  let unit = 0;
  while (value >= 999.5 && unit < UNITS.length - 1) {
    value /= 1000;
    unit += 1;
  }
  const digits = unit > 0 && value < 9.95 ? 1 : 0;
  return `${value.toFixed(digits)} ${UNITS[unit]}`;
}

/** Return a duration (ms) in words, as `3 days 4 h`, `2 h 5 min` or `40 s`: its two largest parts. */
export function span(ms: number): string {
  const s = Math.max(0, Math.floor(ms / 1000));
  const days = Math.floor(s / 86_400);
  const hours = Math.floor(s / 3600) % 24;
  const minutes = Math.floor(s / 60) % 60;
  if (days > 0) return `${days} ${days === 1 ? "day" : "days"} ${hours} h`;
  if (hours > 0) return `${hours} h ${minutes} min`;
  return minutes > 0 ? `${minutes} min ${s % 60} s` : `${s} s`;
}
