/** Reads one moment of a recorded run, for a dry-run that continues from there. Pure. */
import type { Behaviour } from "../api/dry-runs";
import type { ActionRun, Run, Visit } from "../api/runs";
import { fullName, type Graph, type Key } from "../graph/model";
import { boundsText } from "../status/durations";
import { visitBegin, visitDuration, visitDurationBound } from "../status/progress";
import { counted } from "../words/counted";
import type { DryRunSeed, SeedDoubt, SeededAction, SeedValue } from "./seed";

type VisitState = "ended" | "goes on" | "not begun";

const time = (text: string | null): number | null => (text === null ? null : Date.parse(text));

/** Return the state of a visit at a moment; `sure`: it holds for all times within its bounds. */
export function visitAt(visit: Visit, at: number): { state: VisitState; sure: boolean } {
  const [earliest, seen] = [time(visit.not_before), visitBegin(visit)];
  if (seen === null || seen > at) {
    return { state: "not begun", sure: earliest === null || earliest > at };
  }
  const [until, latest] = [time(visit.until), time(visit.not_after)];
  if (until === null || until > at) return { state: "goes on", sure: true };
  if (latest !== null && latest <= at) return { state: "ended", sure: true };
  // Its end was seen by then, but its code may have gone on.
  return { state: visit.result === null ? "goes on" : "ended", sure: false };
}

/** A visit that had ended, as the simulator repeats it. */
function endedBehaviour(node: string, visit: Visit, doubts: SeedDoubt[]): Behaviour {
  const { took } = visitDuration(visit);
  const bound = visitDurationBound(visit);
  const least = took ?? 0;
  const most = bound === null || bound === Number.POSITIVE_INFINITY ? least : bound;
  if (bound !== null) {
    const known = boundsText({
      least: least / 1000,
      most: bound === Number.POSITIVE_INFINITY ? null : bound / 1000,
    });
    const played = ((least + most) / 2000).toFixed(1);
    doubts.push({
      node,
      text: `took ${known ?? "an unknown time"}; the dry-run takes ${played} s`,
    });
  }
  const result = visit.result ?? "true";
  if (visit.result === null) {
    doubts.push({ node, text: "ended with an unknown result; the dry-run takes true" });
  }
  const after_s = Math.round((least + most) / 2) / 1000;
  if (result === "stopped") return { never: true };
  return { after_s, result: `on_${result}` };
}

/** Behaviour of visits that were going on: they never end by themselves, since a person decides. */
const OPEN: Behaviour = { never: true };

interface Found extends SeededAction {
  readonly calls: Behaviour[];
  readonly inputs: Visit["inputs"][];
  readonly end: string | null;
}

function seededAction(node: string, action: ActionRun, at: number, doubts: SeedDoubt[]): Found {
  const calls: Behaviour[] = [];
  const inputs: Visit["inputs"][] = [];
  let [ended, end]: [number, string | null] = [0, null];
  if (action.older > 0) {
    doubts.push({ node, text: `its first ${action.older} visits were not recorded one by one` });
  }
  for (const visit of action.visits) {
    const { state, sure } = visitAt(visit, at);
    if (!sure) {
      const may =
        state === "not begun"
          ? "may have begun"
          : state === "ended"
            ? "may go on"
            : "may have ended";
      doubts.push({ node, text: `${may} by then: the exact time was not seen` });
    }
    if (state === "not begun") continue;
    inputs.push(visit.inputs);
    if (state === "ended") {
      ended += 1;
      calls.push(endedBehaviour(node, visit, doubts));
    } else {
      calls.push(OPEN);
      end = visit.until === null ? null : (visit.result ?? "with an unknown result");
    }
  }
  return { node, begun: calls.length, ended, calls, inputs, end };
}

/** The names of the actions of a run in the graph that is played, by their names in the run. */
function namesNow(run: Run, graph: Graph, doubts: SeedDoubt[]): Map<string, string> {
  const byKey = new Map<Key, string>(graph.actions.map((each) => [each.key, fullName(each)]));
  const names = new Map<string, string>();
  for (const [name, action] of Object.entries(run.actions ?? {})) {
    if (action.aid === null) {
      if (action.visits.length > 0) {
        doubts.push({
          node: name,
          text: "belongs to a sub-graph, which the dry-run plays as usual",
        });
      }
      continue;
    }
    const now = byKey.get(action.aid) ?? null;
    if (now !== null) names.set(name, now);
    else if (action.visits.length > 0) {
      doubts.push({ node: name, text: "ran, and is not in this graph any more" });
    }
  }
  return names;
}

function valuesAt(run: Run, names: ReadonlyMap<string, string>, at: number): SeedValue[] {
  return [...names].flatMap(([name, node]) => {
    const visits = run.actions?.[name]?.visits ?? [];
    const last = visits.findLast((visit) => visitAt(visit, at).state !== "not begun");
    return Object.entries(last?.inputs ?? {}).map(([parameter, text]) => ({
      node,
      name: parameter.replaceAll("::", " / "),
      text,
    }));
  });
}

/**
 * Returns the beginning of a dry-run from a moment of a run. `graph`: what is played; `differs`: in how many places it
 * is not what ran. `at`: ms since 1970.
 */
export function seedOf(run: Run, graph: Graph, differs: number, at: number): DryRunSeed {
  const doubts: SeedDoubt[] = [];
  if (differs > 0) {
    const places = counted(differs, "place");
    doubts.push({
      node: "",
      text: `The graph on screen differs from the one that ran in ${places}; the dry-run plays the one on screen`,
    });
  }
  const names = namesNow(run, graph, doubts);
  const found = [...names].flatMap(([name, node]) => {
    const action = run.actions?.[name];
    return action === undefined ? [] : [seededAction(node, action, at, doubts)];
  });
  const begun = found.filter(({ calls }) => calls.length > 0);
  const values = valuesAt(run, names, at);
  const silent = begun.filter(({ node }) => !values.some((value) => value.node === node));
  if (silent.length > 0) {
    const text = `The values of ${silent.length} of ${begun.length} actions were not seen; the dry-run takes those of the graph`;
    doubts.push({ node: "", text });
  }
  const ends = begun.flatMap(({ node, end }) => (end === null ? [] : [[node, end] as const]));
  return {
    run: run.id,
    number: run.number,
    at: at - Date.parse(run.started_at ?? run.requested_at),
    behaviours: Object.fromEntries(begun.map(({ node, calls }) => [node, calls])),
    actions: found.map(({ node, begun, ended }) => ({ node, begun, ended })),
    inputs: Object.fromEntries(begun.map(({ node, inputs }) => [node, inputs])),
    ends: new Map(ends),
    values,
    started: run.values ?? {},
    doubts,
  };
}
