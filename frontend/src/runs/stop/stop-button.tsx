/** STOP: one, always at the same place, never disabled; STOP ALL by keys from anywhere. */

import type { LiveLink, SiteState } from "../../api/live-socket";
import { foreignGraphs, openRuns, silentSites, unheardRobots } from "../../api/live-socket";
import { useLive } from "../../api/page-link";
import type { Run } from "../../api/runs";
import { useWatched } from "../../ui/watched";
import { counted } from "../../words/counted";
import { isolated } from "../../words/isolated";
import style from "./stop-button.module.css";
import { drawnStop, graphOnScreen } from "./stop-surroundings";

/** Return the text beside STOP. `count`: how many runs go on; `unknown`: how many robots do not say what they run. */
export function stopButtonText(link: LiveLink, count: number, unknown = 0): string {
  if (link === "down") return "state unknown";
  if (link === "connecting") return "asking …";
  if (count === 0) return unknown === 0 ? "nothing runs" : `${unknown} unknown`;
  return counted(count, "run");
}

/**
 * Return what STOP means on the page of a graph: its one run, or all runs that were started
 * together.
 */
export function runToStop(here: readonly Run[]): { id: string; words: string } | null {
  const [first, ...others] = here;
  if (first === undefined) return null;
  if (others.length === 0) {
    return { id: first.id, words: `run ${first.number} of ${isolated(first.graph_name)}` };
  }
  const { group } = first;
  if (group === null || others.some((run) => run.group !== group)) return null;
  return { id: group, words: `the ${here.length} runs of ${isolated(first.graph_name)}` };
}

const keepButton = (button: HTMLElement | null) => drawnStop.set(button);

/** A silent site may have robots that this page has never heard of. */
const hasNoRobot = ({ state }: SiteState) => state.engines.every(({ simulated }) => simulated);

const SOFT = "A software stop: no replacement for the emergency stop.";

export function StopButton() {
  const { live, now } = useLive();
  const graph = useWatched(graphOnScreen);
  const open = openRuns(now);
  const here = graph === null ? [] : open.filter((run) => run.graph === graph);
  const meant = runToStop(here);
  const all = open.length + foreignGraphs(now).length;
  const silent = silentSites(now);
  const calm = now.link === "live" && all === 0 && silent.length === 0;
  const unknown = unheardRobots(now).length + silent.filter(hasNoRobot).length;
  const target = meant?.words ?? "everything that runs";
  const isUnseen = now.link === "live" && silent.length > 0; // more may run than this page knows
  const beside = meant !== null && (all > here.length || isUnseen);
  // One text in each element: what a translation wraps is then replaced whole.
  return (
    <span className={style.both} data-beside={beside || undefined}>
      <button
        ref={keepButton}
        type="button"
        className={style.stop}
        data-calm={calm || undefined}
        onClick={() => live?.stop(meant?.id ?? "all")}
        title={`Stop ${target}.\n${SOFT}`}
      >
        <span className={style.read}>{`Stop ${target}. Software stop, no emergency stop`}</span>
        <svg viewBox="0 0 13 13" width={13} height={13} aria-hidden style={{ flex: "none" }}>
          <rect x="1.5" y="1.5" width="10" height="10" rx="1.5" fill="currentColor" />
        </svg>
        <span className={style.word} aria-hidden>
          {`STOP${meant || all === 0 ? "" : " ALL"}`}
        </span>
        <span className={style.count} aria-hidden>
          {stopButtonText(now.link, meant ? here.length : all, unknown)}
        </span>
      </button>
      {beside && (
        <button
          type="button"
          className={style.all}
          onClick={() => live?.stop("all")}
          title={`Stop everything that runs (Ctrl+.).\n${SOFT}`}
        >
          <span className={style.read}>
            Stop everything that runs, everywhere. Software stop, no emergency stop
          </span>
          <span aria-hidden>{`ALL ${isUnseen ? "?" : all}`}</span>
        </button>
      )}
    </span>
  );
}
