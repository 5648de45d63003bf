/** Says of which sites a list has nothing, since they do not answer, or not rightly; nothing with one runner. */
import { useMissingSites } from "../api/missing-sites";

/** Names the sites of which a list lacks their part. `missing`: what is not known of such a site, as "what waits there is not known". */
export function SilentSites({ route, missing }: { route: string; missing: string }) {
  return useMissingSites(route).map(({ url, words }) => (
    <p key={url} className="m-0 quiet-12" role="status">
      {words}: {missing}.
    </p>
  ));
}
