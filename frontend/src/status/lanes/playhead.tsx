/** Where one is in time: at the live edge, or where a replay stands. */
import { useRef } from "react";
import { stopwatch, useNow } from "../../ui/times";
import { shareOf, type TimeAxis } from "./axis";
import { useMoving, WHOLE_WAY } from "./moving";
import style from "./timeline.module.css";

/** Where the sign of a moment has room beside its line. */
type Side = "left" | "right" | undefined;

const sideOf = (share: number): Side => (share > 0.9 ? "left" : share < 0.06 ? "right" : undefined);

function Cursor({ side, label, live }: { side: Side; label: string; live: boolean }) {
  return (
    <i className={style.cursor} data-live={live || undefined}>
      <b data-side={side}>{label}</b>
    </i>
  );
}

/** What is told of a moment is drawn anew once a second; its line moves meanwhile. */
function LiveCursor({ axis, silentSince }: { axis: TimeAxis; silentSince: number | null }) {
  const now = useNow(1000);
  const words = silentSince === null ? "live" : "not known";
  const label = `${stopwatch(now - axis.start)} ${words}`;
  return <Cursor side={sideOf(shareOf(axis, now))} label={label} live={silentSince === null} />;
}

/** Moves with time. `silentSince`: what it shows is not known from there on. */
function LiveHead({ axis, silentSince }: { axis: TimeAxis; silentSince: number | null }) {
  const sweep = useRef<HTMLDivElement>(null);
  useMoving(sweep, axis, WHOLE_WAY);
  return (
    <div ref={sweep} className={style.sweep}>
      <LiveCursor axis={axis} silentSince={silentSince} />
    </div>
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
        <div className={style.sweep} style={{ transform: `translateX(${share * 100}%)` }}>
          <Cursor side={sideOf(share)} label={stopwatch(cursor - axis.start)} live={false} />
        </div>
      </>
    );
  }
  return goes ? <LiveHead axis={axis} silentSince={silentSince} /> : null;
}
