/** STOP: one, always at the same place, never disabled. */
import { IconSquareFilled } from "@tabler/icons-react";
import { openRuns, useLive } from "../api/use-live";
import style from "./stop-button.module.css";

interface Props {
  /** The graph on screen: its run is the one that Stop means, if it goes. */
  graph?: string;
}

function words(link: string, count: number): string {
  if (link === "down") return "state unknown";
  if (count === 0) return "nothing runs";
  return count === 1 ? "1 run" : `${count} runs`;
}

export function StopButton({ graph }: Props) {
  const { live, now } = useLive();
  const open = openRuns(now);
  const here = open.filter((run) => run.graph === graph);
  const [only] = here.length === 1 ? here : [];
  const calm = now.link === "live" && open.length === 0;
  const target = only ? `run ${only.number} of ${only.graph_name}` : "everything that runs";
  return (
    <button
      type="button"
      className={style.stop}
      data-calm={calm || undefined}
      onClick={() => live?.stop(only?.id ?? "all")}
      aria-label={`Stop ${target}. Software stop, no emergency stop`}
      title={`Stop ${target}.\nA software stop: no replacement for the emergency stop.`}
    >
      <IconSquareFilled size={13} aria-hidden style={{ flex: "none" }} />
      <span className={style.word}>STOP</span>
      <span className={style.count}>{words(now.link, only ? 1 : open.length)}</span>
    </button>
  );
}
