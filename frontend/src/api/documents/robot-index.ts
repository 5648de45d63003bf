/** The folder that a robot indexes: what the runner may write there. */
import { fetchJson } from "../http";
import type { Inside } from "../runs";
import type { RunnerApi } from "../schema/runner";

/** As the runner has it, and what could be written there. */
export type IndexFolderLook = RunnerApi["IndexFolderState"];

/** Has graphs inside of a task written there. */
export function writeIntoIndex(
  runner: string,
  robot: string,
  body: { digest: string; replace: string[] } & Inside,
): Promise<RunnerApi["IndexWriteAnswer"]> {
  const route = `${runner}/api/robots/${encodeURIComponent(robot)}/index`;
  return fetchJson(route, { method: "POST", body, timeoutMs: 30_000 });
}
