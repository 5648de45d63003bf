/** Where one is in time: at the live edge, or where a replay stands. */
import { stopwatch, useNow } from "../../ui/times";
import { renewalOf, shareOf, type TimeAxis } from "./axis";
import style from "./timeline.module.css";

function Head({ share, label, live }: { share: number; label: string; live: boolean }) {
  return (
    <div className={style.sweep} style={{ transform: `translateX(${share * 100}%)` }}>
      <i className={style.cursor} data-live={live || undefined}>
        <b data-side={share > 0.9 ? "left" : share < 0.06 ? "right" : undefined}>{label}</b>
      </i>
    </div>
  );
}

/** Moves with time. `silentSince`: what it shows is not known from there on. */
function LiveHead({ axis, silentSince }: { axis: TimeAxis; silentSince: number | null }) {
  const now = useNow(renewalOf(axis));
  const words = silentSince === null ? "live" : "not known";
  return (
    <Head
      share={shareOf(axis, now)}
      label={`${stopwatch(now - axis.start)} ${words}`}
      live={silentSince === null}
    />
  );
}

interface Props {
  axis: TimeAxis;
  /** Where a replay stands, ms; null at the live edge, or at the end of what is over. */
  cursor: number | null;
  goes: boolean;
  silentSince: number | null;
}

export function Playhead({ axis, cursor, goes, silentSince }: Props) {
  if (cursor !== null) {
    const share = shareOf(axis, cursor);
    return (
      <>
        <i className={style.later} style={{ left: `${share * 100}%` }} />
        <Head share={share} label={stopwatch(cursor - axis.start)} live={false} />
      </>
    );
  }
  return goes ? <LiveHead axis={axis} silentSince={silentSince} /> : null;
}
