/** Playback of a trace: moments, what is seen at each, and what it says in words. Pure. */

import type { TraceEvent } from "../api/dry-runs";
import { fullName, type Graph, type Key } from "../graph/model";
import { finishedWords, type Progress, STATE_WORDS } from "../status/progress";
import { isolated } from "../words/isolated";

/** All that happens at one time. */
export interface PlaybackMoment {
  readonly at: number; // ms since the start
  /** The events before `to` have happened. */
  readonly to: number;
}

/** An action that runs, in its visit number `call`, counted from 0. */
export interface RunningAction {
  readonly key: Key;
  readonly node: string;
  readonly call: number;
  readonly since: number;
}

export interface PlaybackState {
  readonly progress: ReadonlyMap<Key, Progress>;
  readonly running: readonly RunningAction[];
  /** The graph's state, RUNNING say; empty before it has one. */
  readonly state: string;
}

/** Moments at which something can be seen to happen. */
export function momentsOf(trace: readonly TraceEvent[]): PlaybackMoment[] {
  const moments: { at: number; to: number; seen: boolean }[] = [];
  for (const [i, event] of trace.entries()) {
    const last = moments.at(-1);
    const seen = event.kind !== "edge" && event.kind !== "not_ready";
    if (last && last.at === event.t_ms) {
      last.to = i + 1;
      last.seen ||= seen;
    } else moments.push({ at: event.t_ms, to: i + 1, seen });
  }
  return moments.filter(({ seen }) => seen).map(({ at, to }) => ({ at, to }));
}

interface PlayedVisit {
  state: string;
  result: string | null;
  since: number;
  took: number | null;
  visits: number;
  message: string | null;
}

/** The actions of one graph by the names that a trace gives them. */
export function keysByName(graph: Pick<Graph, "actions">): ReadonlyMap<string, Key> {
  return new Map(graph.actions.filter((a) => !a.missing).map((a) => [fullName(a), a.key]));
}

function progressOf(visit: PlayedVisit, over: boolean): Progress {
  const { tone, word } = wordOf(visit, over);
  return {
    tone,
    word,
    since: null,
    took: visit.took,
    atMost: null,
    visits: visit.visits,
    inferred: false,
    message: visit.message,
  };
}

function wordOf({ state, result }: PlayedVisit, over: boolean): Pick<Progress, "tone" | "word"> {
  if (state === "RUNNING" && over) return { tone: "run", word: "still runs" };
  if (state === "FINISHED") return finishedWords(result);
  return STATE_WORDS.get(state) ?? { tone: "idle", word: over ? "did not run" : "waits" };
}

/** Return the visits of each action and the state of the graph after the first `to` events. */
function played(trace: readonly TraceEvent[], to: number, graph: Pick<Graph, "name">) {
  const visits = new Map<string, PlayedVisit>();
  let state = "";
  for (const event of trace.slice(0, to)) {
    if (event.graph !== graph.name) continue;
    if (event.kind === "graph_state") state = event.state;
    if (event.kind !== "node_state" && event.kind !== "node_result") continue;
    const visit = visits.get(event.node) ?? { ...WAITING, since: event.t_ms };
    visits.set(event.node, visit);
    if (event.kind === "node_result") {
      visit.result = event.result;
      visit.took = event.t_ms - visit.since;
      visit.message = event.message ?? null;
    } else {
      const begins = event.state === "RUNNING" && !HELD.has(visit.state);
      if (begins) {
        visit.visits += 1;
        visit.since = event.t_ms;
        visit.took = null;
        visit.result = null;
      }
      visit.state = event.state;
    }
  }
  return { visits, state };
}

/** Return the state of the playback after the first `to` events. */
export function playbackStateAt(
  trace: readonly TraceEvent[],
  to: number,
  graph: Pick<Graph, "name" | "actions">,
  keys = keysByName(graph),
): PlaybackState {
  const { visits, state } = played(trace, to, graph);
  const over = ENDED.has(state);
  const progress = new Map<Key, Progress>();
  const going: RunningAction[] = [];
  for (const [node, key] of keys) {
    const visit = visits.get(node) ?? { ...WAITING };
    progress.set(key, progressOf(visit, over));
    if (visit.state === "RUNNING" && visit.result === null) {
      going.push({ key, node, call: visit.visits - 1, since: visit.since });
    }
  }
  return { progress, running: going, state };
}

const HELD = new Set(["PAUSED", "PAUSE_REQUESTED"]);
const ENDED = new Set(["FINISHED", "HALTED", "STOPPED", "ERROR"]);
const WAITING: PlayedVisit = {
  state: "",
  result: null,
  since: 0,
  took: null,
  visits: 0,
  message: null,
};

/** Describe the events of one moment in short sentences, the most important first. */
export function momentWords(
  trace: readonly TraceEvent[],
  moment: PlaybackMoment,
  before: number,
  nameOf: (node: string) => string = (node) => node,
): string[] {
  const ends: string[] = [];
  const begins: string[] = [];
  const waits = new Map<string, string>();
  const [graph, hazards]: [string[], string[]] = [[], []];
  for (const event of trace.slice(before, moment.to)) {
    switch (event.kind) {
      case "node_result":
        ends.push(`${nameOf(event.node)} ${ENDINGS[event.result] ?? event.result}`);
        break;
      case "node_state":
        waits.delete(event.node);
        if (event.state === "RUNNING") begins.push(nameOf(event.node));
        if (event.state in SAID) ends.push(`${nameOf(event.node)} ${SAID[event.state]}`);
        break;
      case "not_ready":
        waits.set(event.node, waitWords(event.why));
        break;
      case "graph_state":
        if (event.state in GRAPH) graph.push(GRAPH[event.state] ?? "");
        break;
      case "graph_result":
        graph.push(`The graph ends: ${event.value.replace(/^on_/, "")}`);
        break;
      case "hazard":
        hazards.push(`${event.code}: ${event.message || event.effect}`);
        break;
      case "edge":
      case "dispatch":
        break;
    }
  }
  const waiting = [...waits].map(([node, why]) => `${nameOf(node)} ${why}`);
  return [...hazards, ...ends, ...graph, ...runWords(begins), ...waiting];
}

function runWords(names: readonly string[]): string[] {
  return names.length > 0 ? [`${listed(names)} ${names.length > 1 ? "run" : "runs"}`] : [];
}

const ENDINGS: Readonly<Record<string, string>> = {
  on_true: "ends true",
  on_false: "ends false",
  on_error: "ends with an error",
  on_stopped: "is stopped",
};
const SAID: Readonly<Record<string, string>> = {
  PAUSED: "is paused",
  STOPPING: "is asked to stop",
};
const GRAPH: Readonly<Record<string, string>> = {
  HALTED: "The graph halts: nothing runs and no exit was reached",
  STOPPED: "The graph is stopped",
  ERROR: "The graph ends in an error",
  PAUSED: "The graph is paused",
};

function waitWords(why: string): string {
  const inputs = why.includes("inputs=missing");
  const parents = why.includes("parents=missing");
  if (inputs && parents) return "waits for a value and for other actions";
  return inputs ? "waits for a value" : "waits for other actions";
}

function listed(all: readonly string[]): string {
  const names = all.map(isolated);
  const last = names.at(-1) ?? "";
  return names.length < 2 ? last : `${names.slice(0, -1).join(", ")} and ${last}`;
}
