/** A run once more in the simulator: the graph that it ran or the newest one, doing what it did then. */

import { insideOf } from "../../api/documents/inside";
import { graphMoment } from "../../api/documents/texts";
import { publish, type Version } from "../../api/graphs";
import { fetchText } from "../../api/http";
import { type InjectedFault, recordedScriptFor, recordedScriptOf, umrfUrl } from "../../api/review";
import { getRun } from "../../api/run-stop";
import { type Inside, type Run, startRun } from "../../api/runs";
import { memberText } from "../../graph/json-members";

export type RepeatedVersion = "same" | "newest";

export interface Injected {
  action: string;
  fault: InjectedFault;
}

export interface Repeated {
  run: string;
  /** What the run did not tell, so that the script had to choose. */
  doubts: readonly { action: string; text: string }[];
}

interface SentGraph {
  version: string;
  digest: string;
  umrf: string;
  inside: Inside;
}

/** The graph as it is now, published as exactly that. */
async function newestOf(graph: string): Promise<SentGraph> {
  const { seq } = await graphMoment(graph);
  const text = await publish(graph, seq);
  const version = JSON.parse(text) as Version;
  const umrf = memberText(text, "umrf");
  if (umrf === null) throw new Error("The editor gave no graph with the version.");
  return { version: version.id, digest: version.digest, umrf, inside: insideOf(version) };
}

/** Starts it; whatever was not seen is chosen, and told. */
export async function repeatRun(
  runner: string,
  run: Run,
  which: RepeatedVersion,
  fault?: Injected,
): Promise<Repeated> {
  const sent: SentGraph =
    which === "newest" && run.graph !== null
      ? await newestOf(run.graph)
      : {
          version: run.version ?? "",
          digest: run.digest,
          umrf: await fetchText(umrfUrl(runner, run.id)),
          inside: insideOf(run.subgraphs === undefined ? await getRun(runner, run.id) : run),
        };
  const script =
    which === "newest"
      ? await recordedScriptFor(runner, run.id, sent.umrf, fault)
      : await recordedScriptOf(runner, run.id, fault);
  const started = await startRun({
    runner,
    ...sent,
    graph: run.graph ?? "",
    engines: ["simulator"],
    request: crypto.getRandomValues(new Uint32Array(4)).join("-"),
    script: { behaviours: script.behaviours },
  });
  return { run: started.runs[0]?.id ?? "", doubts: script.doubts };
}
