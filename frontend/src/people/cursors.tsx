/** The pointers of the others on the canvas: they glide from word to word, and keep their size. */
import { useStore, ViewportPortal } from "@xyflow/react";
import { memo } from "react";
import { checkedColor } from "../api/people";
import type { Position } from "../graph/model";
import { usePeople } from "../sync/use-room";
import style from "./cursors.module.css";
import { colored, Name } from "./people";

interface CursorProps {
  x: number;
  y: number;
  name: string;
  color: string;
}

/** The browser glides it: only `transform` changes, so nothing is laid out or painted anew. */
const Cursor = memo(function Cursor({ x, y, name, color }: CursorProps) {
  return (
    <div
      className={style.cursor}
      style={{ transform: `translate(${x}px, ${y}px)`, ...colored(color) }}
      aria-hidden
    >
      <div className={style.pointer}>
        <svg width="14" height="18" viewBox="0 0 14 18" aria-hidden="true">
          <path d="M1 1v13.5l3.8-3.4 2.5 5.6 2.4-1.1-2.5-5.4h5.1z" fill="var(--c)" stroke="#fff" />
        </svg>
        <span>
          <Name of={{ name }} />
        </span>
      </div>
    </div>
  );
});

/** However far the canvas is away, pointers and names can be read. */
function AtOwnSize({ children }: { children: React.ReactNode }) {
  const zoom = useStore(({ transform }) => transform[2]);
  return (
    <div className={style.layer} style={{ "--at-own-size": 1 / zoom } as React.CSSProperties}>
      {children}
    </div>
  );
}

const same = (at: Position): Position => at;

/** Draws the pointers of the others. `toView`: where a place on the canvas is drawn. */
export function Cursors({ toView = same }: { toView?: (at: Position) => Position }) {
  const people = usePeople();
  const pointing = people.filter(({ presence }) => presence.cursor !== undefined);
  if (pointing.length === 0) return null;
  return (
    <ViewportPortal>
      <AtOwnSize>
        {pointing.map(({ client, name, color, presence }) => {
          const [x, y] = toView(presence.cursor ?? [0, 0]);
          return <Cursor key={client} x={x} y={y} name={name} color={checkedColor(color)} />;
        })}
      </AtOwnSize>
    </ViewportPortal>
  );
}
