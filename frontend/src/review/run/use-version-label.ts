/** The name of the version that a run ran. */
import { useVersions, versionName } from "../../api/graphs";
import type { Run } from "../../api/runs";

export function useVersionLabel(run: Run): string {
  const versions = useVersions(run.graph ?? "", run.version).data;
  return versionName(versions, run.version) || run.digest.slice(0, 7);
}
