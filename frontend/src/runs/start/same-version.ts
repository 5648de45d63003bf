/** Finds the version that had the graph of a moment already: comments and notes make another version, too. Pure. */
import { type Version, versionName } from "../../api/graphs";

interface Moment {
  readonly digest: string;
  readonly tree: string | undefined;
  readonly seq: number;
}

/** Return the name of the newest version of another moment that has the same graph; "" for none. */
export function sameVersion(versions: readonly Version[], { digest, tree, seq }: Moment): string {
  const isSame = (each: Version) =>
    digest !== "" &&
    each.digest === digest &&
    (tree === undefined || each.tree_digest === tree) &&
    each.seq !== seq;
  const [newest] = versions.filter(isSame).sort((a, b) => b.seq - a.seq);
  return newest === undefined ? "" : versionName(versions, newest.id);
}
