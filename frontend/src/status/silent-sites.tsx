/** Says of which sites a list has nothing, since they do not answer, or not rightly; nothing with one runner. */
import { runnerWords } from "../api/http";
import { silentSites } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useUnsaidSites } from "../api/unsaid-sites";

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

/** Names the sites of which a list lacks their part. `missing`: what is not known of such a site, as "what waits there is not known". */
export function SilentSites({ route, missing }: { route: string; missing: string }) {
  return useMissingSites(route).map(({ url, words }) => (
    <p key={url} className="m-0 quiet-12" role="status">
      {words}: {missing}.
    </p>
  ));
}
