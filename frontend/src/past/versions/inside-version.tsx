/** The graphs inside of a version: what they were when it was published, and whether they are that still. */
import { useQuery } from "@tanstack/react-query";
import { Link } from "wouter";
import { fetchVersion, type PinnedGraph } from "../../api/documents/versions";
import type { Version } from "../../api/graphs";
import { shortDigest } from "./version-facts";
import style from "./versions.module.css";

const NONE: readonly PinnedGraph[] = [];

/** Whether a name stands for the same thing still. */
function stateOf({ digest, current_digest }: PinnedGraph): "same" | "changed" | "gone" {
  if (current_digest === null) return "gone";
  return current_digest === digest ? "same" : "changed";
}

const STATE_WORDS = { same: "as it is now", changed: "changed since", gone: "no graph any more" };

export function InsideVersion({ version }: { version: Version }) {
  const { id, digest, tree_digest } = version;
  const { data: graphs = NONE } = useQuery({
    enabled: tree_digest !== null && tree_digest !== digest,
    queryKey: ["versions", id, "inside"],
    queryFn: async ({ signal }) => (await fetchVersion(id, signal)).subgraphs ?? NONE,
    staleTime: 0,
  });
  if (graphs.length === 0) return null;
  const changed = graphs.filter((each) => stateOf(each) !== "same").length;
  return (
    <>
      <p className={style.quiet}>
        {graphs.length === 1 ? "1 graph" : `${graphs.length} graphs`} inside
        {changed > 0 && `, ${changed} otherwise now: published again, it takes them as they are`}
      </p>
      <ul className={style.inside} aria-label="Graphs inside of it">
        {graphs.map((each) => (
          <li key={each.name} data-state={stateOf(each)}>
            <Link to={`/graphs/${each.graph}`}>
              <bdi>{each.name}</bdi>
            </Link>
            <code title={each.digest}>{shortDigest(each.digest)}</code>
            <span className={style.quiet}>{STATE_WORDS[stateOf(each)]}</span>
          </li>
        ))}
      </ul>
    </>
  );
}
