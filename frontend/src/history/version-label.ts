/** The name of the version that a run ran. */
import { useVersions } from "../api/graphs";
import type { Run } from "../api/runs";

export function useVersionLabel(run: Run): string {
  const versions = useVersions(run.graph).data;
  const version = versions?.find((candidate) => candidate.id === run.version);
  return version?.label || run.digest.slice(0, 7);
}
