/** A start: publishes what is on screen and sends exactly that to the runner, once. */

import { notifications } from "@mantine/notifications";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import type { Script } from "../../api/dry-runs";
import { publish, queryKeys, type Version, versionName } from "../../api/graphs";
import { errorText } from "../../api/http";
import { insideOf } from "../../api/inside";
import type { LedOrder } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { errorPlace } from "../../api/refusal-places";
import { type Started, type StartOrder, startRun, type Watching } from "../../api/runs";
import type { StartFrom, StartValues } from "../../api/starts";
import type { RunBreakpoint } from "../../graph/breakpoints";
import { newAid } from "../../graph/document-keys";
import { memberText } from "../../graph/json-members";
import { sendNoted, Unanswered } from "../../status/unanswered-starts";
import { isolated } from "../../words/isolated";

export interface StartInput {
  /** The moment that shall run; awaited when the page has yet to hear its name. */
  seq: number | Promise<number>;
  engines: readonly string[];
  /** Robots of a led run. */
  led?: LedOrder;
  /** Digest of the graph that a person looked at; null if nobody looked. */
  digest: string | null;
  /** Tree digest, with all sub-graphs, that a person looked at; left out if nobody looked. */
  tree?: string;
  /** Outcomes of actions in the simulator. */
  script?: Script;
  /** Set if actions follow their Python behaviours in the simulator. */
  behaviours?: boolean;
  override?: NonNullable<StartOrder["override"]>;
  /** The robots that the person says to watch. */
  watching?: Watching;
  /** Set for a start by which a Stop drill is made. */
  drill?: boolean;
  /** Breakpoints at which a led run waits. */
  breakpoints?: readonly RunBreakpoint[];
  /** Values of the inputs for which the graph asks. */
  values?: StartValues;
  /** The place where it begins, if not at the entry. */
  from?: StartFrom | undefined;
}

/** A moment as a version, and its graph exactly as the editor wrote it. */
export async function publishedVersion(
  graph: string,
  seq: number,
): Promise<{ version: Version; umrf: string }> {
  const text = await publish(graph, seq);
  const umrf = memberText(text, "umrf");
  if (umrf === null) throw new Error("The editor gave no graph with the version.");
  return { version: JSON.parse(text) as Version, umrf };
}

/** The name that a start of this moment will have. */
export function nextLabel(versions: readonly Version[], seq: number): string {
  const same = versions.find((version) => version.seq === seq);
  return same ? versionName(versions, same.id) : `v${versions.length + 1}`;
}

export function notifyFailure(title: string, message: string): void {
  notifications.show({ color: "red", title, message, autoClose: 15_000 });
}

/**
 * Publish the graph as it is at a change, and return that version. Rejects where it is not the one that was checked.
 * `digest`, `tree`: of what was checked; a null digest where nothing was.
 */
async function checkedVersion(
  graph: string,
  seq: number,
  digest: string | null,
  tree: string | null | undefined,
) {
  const published = await publishedVersion(graph, seq);
  const { version } = published;
  const same = digest === version.digest && (tree ?? version.tree_digest) === version.tree_digest;
  if (digest !== null && !same)
    throw new Error("The graph is not the one that was checked. Nothing was sent.");
  return published;
}

/** A start as it was looked at, without an id of its own yet. */
export type LookedAtOrder = Omit<StartOrder, "request">;

/**
 * Return a function that publishes what was looked at, and returns it as an order with its version. It rejects
 * where the graph is not the one that was looked at.
 */
export function useOrder(graph: string) {
  const { runner } = useLive();
  const client = useQueryClient();
  return async (wanted: StartInput): Promise<{ version: Version; order: LookedAtOrder }> => {
    const { seq, digest, tree, from, ...rest } = wanted;
    if (runner === undefined) throw new Error("The address of the runner is not known yet.");
    const { version, umrf } = await checkedVersion(graph, await seq, digest, tree);
    void client.invalidateQueries({ queryKey: queryKeys.versions(graph) });
    const what = { version: version.id, digest: version.digest, umrf, inside: insideOf(version) };
    const order = { ...rest, ...(from === undefined ? {} : { from }), ...what, runner, graph };
    return { version, order };
  };
}

export function useStart(graph: string) {
  const { live } = useLive();
  const client = useQueryClient();
  const ordered = useOrder(graph);
  return useMutation({
    mutationFn: async (wanted: StartInput) => {
      const { version, order } = await ordered(wanted);
      const versions = client.getQueryData<Version[]>(queryKeys.versions(graph)) ?? [];
      const started = await surely(versionWords(versions, version), {
        ...order,
        request: newAid(),
      });
      for (const run of started.runs) live?.learn(run);
      return started;
    },
    onSuccess: ({ failed }) => {
      for (const [robot, why] of Object.entries(failed))
        notifyFailure(`Not started on ${isolated(robot)}`, why);
    },
    onError: (error) => {
      const where = errorPlace(error);
      notifyFailure(
        "Not started",
        where === "" ? errorText(error) : `${errorText(error)} (${where})`,
      );
    },
  });
}

const NOTHING_KNOWN: Started = { runs: [], failed: {} };

/** Sends a start. Where nobody says what became of it, that is looked for, and no failure is told. */
function surely(what: string, order: StartOrder): Promise<Started> {
  const { request, graph, engines } = order;
  return sendNoted({ request, graph, what, engines }, () => startRun(order)).catch((error) => {
    if (error instanceof Unanswered) return NOTHING_KNOWN;
    throw error;
  });
}

/** Return the version of an order in words, as "v3 of patrol". */
export function versionWords(versions: readonly Version[], version: Version): string {
  return `${nextLabel(versions, version.seq)} of ${nameIn(version)}`;
}

function nameIn(version: Version): string {
  const name = version.umrf?.graph_name;
  return typeof name === "string" && name !== "" ? name : "untitled";
}

const CHOICE = "aa.engines";
const LED = "aa.led";

/** Return the robots with which this browser last started a led run of a graph. */
export function lastLed(graph: string): LedOrder | null {
  try {
    const all = JSON.parse(localStorage.getItem(LED) ?? "{}") as Record<string, LedOrder>;
    const found = all[graph];
    return found !== undefined && typeof found.robots === "object" ? found : null;
  } catch {
    return null;
  }
}

export function rememberLed(graph: string, led: LedOrder): void {
  try {
    const all = JSON.parse(localStorage.getItem(LED) ?? "{}") as Record<string, LedOrder>;
    localStorage.setItem(LED, JSON.stringify({ ...all, [graph]: led }));
  } catch {
    // A browser that stores nothing asks again next time.
  }
}

/** Return the engines on which this browser last started a graph. */
export function lastEngines(graph: string): string[] {
  try {
    const all = JSON.parse(localStorage.getItem(CHOICE) ?? "{}") as Record<string, string[]>;
    const found = all[graph];
    return Array.isArray(found) && found.length > 0 ? found : ["simulator"];
  } catch {
    return ["simulator"];
  }
}

export function rememberEngines(graph: string, engines: readonly string[]): void {
  try {
    const all = JSON.parse(localStorage.getItem(CHOICE) ?? "{}") as Record<string, string[]>;
    localStorage.setItem(CHOICE, JSON.stringify({ ...all, [graph]: engines }));
  } catch {
    // A browser that stores nothing asks again next time.
  }
}
