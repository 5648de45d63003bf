/** Says of which sites a list has nothing, since they do not answer; nothing with one runner. */
import { runnerWords } from "../api/http";
import { silentSites } from "../api/live-socket";
import { useLive } from "../api/page-link";

/** Names the sites that do not answer. `missing`: what is not known of such a site, as "what waits there". */
export function SilentSites({ missing }: { missing: string }) {
  const { now } = useLive();
  return silentSites(now).map(({ site }) => (
    <p key={site.url} className="m-0 quiet-12" role="status">
      {runnerWords(site.name)} does not answer: {missing} is not known.
    </p>
  ));
}
