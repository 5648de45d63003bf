/** Who else is here: faces in the bar, pointers on the canvas. */
import { Tooltip } from "@mantine/core";
import { ViewportPortal } from "@xyflow/react";
import type { Person } from "../room/presence";
import { usePeople } from "../room/use-room";
import { colorsOf, initials } from "../ui/robot";
import style from "./people.module.css";

const MOST = 4;

function nameOf(person: Person): string {
  return person.name || "Guest";
}

/** Each person once, however many windows they have. */
export function onePerId(people: readonly Person[]): Person[] {
  return [...new Map(people.map((person) => [person.id, person])).values()];
}

export function People({ me }: { me: string }) {
  const others = onePerId(usePeople()).filter((person) => person.id !== me);
  if (others.length === 0) return null;
  const shown = others.slice(0, MOST);
  const colors = colorsOf([me, ...others.map((person) => person.id)]);
  const names = others.map(nameOf).join(", ");
  return (
    <div className={style.people}>
      <span className="visually-hidden">Also here: {names}</span>
      {shown.map((person) => (
        <Tooltip key={person.id} label={nameOf(person)}>
          <span className={style.face} style={{ background: colors.get(person.id) }}>
            {initials(nameOf(person))}
          </span>
        </Tooltip>
      ))}
      {others.length > MOST && (
        <span className={style.face} data-more>
          +{others.length - MOST}
        </span>
      )}
    </div>
  );
}

export function Cursors({ me }: { me: string }) {
  const people = usePeople();
  const colors = colorsOf([me, ...people.map((person) => person.id)]);
  return (
    <ViewportPortal>
      {people.map((person) => {
        const at = person.presence.cursor;
        if (!at) return null;
        return (
          <div
            key={person.client}
            className={style.cursor}
            style={
              {
                transform: `translate(${at[0]}px, ${at[1]}px)`,
                "--c": colors.get(person.id),
              } as React.CSSProperties
            }
            aria-hidden
          >
            <svg width="14" height="18" viewBox="0 0 14 18" aria-hidden="true">
              <path
                d="M1 1v13.5l3.8-3.4 2.5 5.6 2.4-1.1-2.5-5.4h5.1z"
                fill="var(--c)"
                stroke="#fff"
              />
            </svg>
            <span>{nameOf(person)}</span>
          </div>
        );
      })}
    </ViewportPortal>
  );
}
