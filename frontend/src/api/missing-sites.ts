/** Names the sites whose part of a list is missing; none with one runner. */
import { runnerWords } from "./http";
import { silentSites } from "./live-socket";
import { useLive } from "./page-link";
import { useUnsaidSites } from "./unsaid-sites";

interface MissingSite {
  readonly url: string;
  readonly words: string;
}

/** Return the sites of which a list lacks their part. `route`: of the list, as "get /api/queue". */
export function useMissingSites(route: string): readonly MissingSite[] {
  const silent = silentSites(useLive().now).map(({ site }) => ({
    url: site.url,
    words: `${runnerWords(site.name)} does not answer`,
  }));
  const unsaid = useUnsaidSites(route)
    .filter(({ site }) => silent.every(({ url }) => url !== site.url))
    .map(({ site, why }) => ({
      url: site.url,
      words: `${runnerWords(site.name)} gives no usable answer (${why.replace(/\.$/, "")})`,
    }));
  return [...silent, ...unsaid];
}
