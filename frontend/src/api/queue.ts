/** The queue: starts that wait for robots, and for a person. */
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { useRef } from "react";
import { runnerAt } from "./client";
import { CONDUCTED } from "./led-runs";
import { useLive } from "./page-link";
import { type Started, type StartOrder, startBody, type Watching } from "./runs";
import type { RunnerApi } from "./schema/runner";

export type Queue = RunnerApi["QueueShown"];
export type QueueEntry = RunnerApi["EntryShown"];
export type RobotQueue = RunnerApi["RobotQueueShown"];
export type QueueLook = RunnerApi["LookShown"];

/** Return how often a value became another one. */
function useChanges(value: object | undefined): number {
  const [count, last] = [useRef(0), useRef(value)];
  if (last.current !== value) count.current += 1;
  last.current = value;
  return count.current;
}

const LOOK_AGAIN = 5_000; // ms

/**
 * Query what a look before the start of an entry finds, again and again once a person has asked for it:
 * a baton or a yes may come. `refetch` asks for it.
 */
export function useEntryLook(entry: string, watching: Watching, asked: boolean) {
  const { runner } = useLive();
  return useQuery({
    queryKey: ["queue-look", entry, watching],
    queryFn: () => lookAtEntry(runner ?? "", entry, watching),
    enabled: asked && runner !== undefined,
    refetchInterval: LOOK_AGAIN,
    placeholderData: keepPreviousData,
    gcTime: 0,
    staleTime: 0,
    retry: false,
  });
}

/** Query the queue; anew whenever the runner says that it has changed. */
export function useQueue(enabled = true) {
  const { runner, now } = useLive();
  return useQuery({
    queryKey: ["queue", useChanges(now.queue)],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/queue", { signal }),
    enabled: enabled && runner !== undefined,
    placeholderData: keepPreviousData,
    gcTime: 0, // a page that comes again begins to count anew, and must not be shown an old queue
  });
}

/** Put a start into the queue of its robots, once; it is not sent again. Nothing starts by that. */
export async function enterQueue(order: StartOrder): Promise<Queue> {
  const [engine = "", ...others] = order.engines;
  const start = { ...(await startBody(order)), engine };
  const engines = others.length > 0 ? { engines: order.engines } : {};
  const body = { start, ...engines } as RunnerApi["QueueRequest"];
  return runnerAt(order.runner).post("/api/queue", { body });
}

function lookAtEntry(runner: string, entry: string, watching: Watching): Promise<QueueLook> {
  const path = { entry };
  return runnerAt(runner).post("/api/queue/{entry}/look", { path, body: { watching } });
}

/** Return the request id of the one start of an entry. */
export const requestOfEntry = (entry: string): string => `queue/${entry}`;

/** Return the engines of the runs that an entry becomes. */
export const enginesOfEntry = ({ engine, robots }: QueueEntry): readonly string[] =>
  engine === CONDUCTED || robots.length < 2 ? [engine] : robots;

/** Start an entry at its turn, exactly as it was looked at. */
export async function startEntry(
  runner: string,
  entry: string,
  look: string,
  watching: Watching,
): Promise<Started> {
  const request = { path: { entry }, body: { look, watching } };
  const found = await runnerAt(runner).post("/api/queue/{entry}/start", request);
  return { runs: [found, ...found.others], failed: found.failed };
}

/** Move an entry before another one, or to the end by "". */
export function moveEntry(runner: string, entry: string, before: string): Promise<Queue> {
  const path = { entry };
  return runnerAt(runner).post("/api/queue/{entry}/move", { path, body: { before } });
}

export function removeEntry(runner: string, entry: string): Promise<Queue> {
  return runnerAt(runner).post("/api/queue/{entry}/remove", { path: { entry } });
}

/** Close the queue of a robot; a run that goes on is not stopped. */
export function closeQueue(runner: string, robot: string): Promise<Queue> {
  return runnerAt(runner).post("/api/queue/robots/{name}/close", { path: { name: robot } });
}

/** Open the closed queue of a robot again after a look. */
export function openQueue(runner: string, robot: string, closing: string): Promise<Queue> {
  const path = { name: robot };
  return runnerAt(runner).post("/api/queue/robots/{name}/open", { path, body: { closing } });
}
