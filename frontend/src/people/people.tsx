/** Who else is here: faces in the bar, pointers on the canvas, and who is at which card. */
import { Tooltip } from "@mantine/core";
import { ViewportPortal } from "@xyflow/react";
import type { CSSProperties } from "react";
import { CARD, type Positions, type Sizes } from "../canvas/geometry/arrange";
import { splitKey } from "../graph/document-keys";
import type { Participant } from "../sync/presence/presence";
import { useFollowing, usePeople } from "../sync/use-room";
import { distinctColors, initials } from "../ui/name-colors";
import style from "./people.module.css";

const MOST = 4;

function personName(person: { readonly name: string }): string {
  return person.name || "Guest";
}

/** A name as it is written, whatever its direction does to what stands beside it. */
function Name({ of }: { of: { readonly name: string } }) {
  return <bdi className={style.name}>{personName(of)}</bdi>;
}

/** Each person once, however many windows they have. */
export function onePerId<T extends { readonly id: string }>(people: readonly T[]): T[] {
  return [...new Map(people.map((person) => [person.id, person])).values()];
}

const colored = (color: string | undefined) => ({ "--c": color }) as CSSProperties;

export function People({ me }: { me: string }) {
  const { whom, follow } = useFollowing();
  const people = usePeople().filter((person) => person.id !== me);
  const leader = people.find(({ client }) => client === whom);
  const others = onePerId(leader ? [...people, leader] : people);
  if (others.length === 0) return null;
  const shown = others.slice(0, MOST);
  const colors = distinctColors([me, ...others.map((person) => person.id)]);
  const names = others.map(personName).join(", ");
  return (
    <div className={style.people}>
      <span className="visually-hidden">Also here: {names}</span>
      {shown.map((person) => {
        const followed = person.client === whom;
        return (
          <Tooltip
            key={person.id}
            label={
              <>
                {followed ? "Stop following" : "Follow"} <Name of={person} />
              </>
            }
          >
            <button
              type="button"
              className={style.face}
              style={colored(colors.get(person.id))}
              aria-pressed={followed}
              aria-label={`Follow ${personName(person)}`}
              onClick={() => follow(followed ? null : person.client)}
            >
              {initials(personName(person))}
            </button>
          </Tooltip>
        );
      })}
      {others.length > MOST && (
        <span className={style.face} data-more>
          +{others.length - MOST}
        </span>
      )}
    </div>
  );
}

/** Around the canvas while it shows what somebody else sees. */
export function FollowFrame({ me }: { me: string }) {
  const { whom, follow } = useFollowing();
  const people = usePeople();
  const leader = people.find(({ client }) => client === whom);
  if (leader === undefined) return null;
  const color = distinctColors([me, ...people.map((person) => person.id)]).get(leader.id);
  return (
    <div className={style.frame} style={colored(color)}>
      <span className={style.followed} role="status">
        Following <Name of={leader} />
        <button type="button" onClick={() => follow(null)}>
          Stop following<kbd aria-hidden>Esc</kbd>
        </button>
      </span>
    </div>
  );
}

export function Cursors({ me }: { me: string }) {
  const people = usePeople();
  const colors = distinctColors([me, ...people.map((person) => person.id)]);
  return (
    <ViewportPortal>
      {people.map((person) => {
        const at = person.presence.cursor;
        if (!at) return null;
        return (
          <div
            key={person.client}
            className={style.cursor}
            style={{
              transform: `translate(${at[0]}px, ${at[1]}px)`,
              ...colored(colors.get(person.id)),
            }}
            aria-hidden
          >
            <svg width="14" height="18" viewBox="0 0 14 18" aria-hidden="true">
              <path
                d="M1 1v13.5l3.8-3.4 2.5 5.6 2.4-1.1-2.5-5.4h5.1z"
                fill="var(--c)"
                stroke="#fff"
              />
            </svg>
            <span>
              <Name of={person} />
            </span>
          </div>
        );
      })}
    </ViewportPortal>
  );
}

interface AtCardsProps {
  me: string;
  places: Positions;
  sizes: Sizes;
}

/** Small initials at the cards of which somebody has a field under their caret. */
export function PeopleAtCards({ me, places, sizes }: AtCardsProps) {
  const people = usePeople();
  const at = new Map<string, Participant[]>();
  for (const person of people) {
    const { head } = splitKey(person.presence.editing ?? "");
    if (person.id !== me && places.has(head)) at.set(head, [...(at.get(head) ?? []), person]);
  }
  if (at.size === 0) return null;
  const colors = distinctColors([me, ...people.map((person) => person.id)]);
  return (
    <ViewportPortal>
      {[...at].map(([key, editors]) => {
        const [x, y] = places.get(key) ?? [0, 0];
        const right = x + (sizes.get(key)?.width ?? CARD.width);
        return (
          <div
            key={key}
            className={style.atCard}
            style={{ transform: `translate(${right}px, ${y}px) translate(-100%, -50%)` }}
          >
            {onePerId(editors).map((person) => (
              <PersonSign key={person.id} person={person} color={colors.get(person.id)} />
            ))}
          </div>
        );
      })}
    </ViewportPortal>
  );
}

interface InitialProps {
  person: { readonly name: string };
  color: string | undefined;
}

/** A person as a small round sign. */
export function PersonSign({ person, color }: InitialProps) {
  return (
    <span
      className={style.initial}
      style={colored(color)}
      title={`${personName(person)} is writing`}
    >
      <span aria-hidden>{initials(personName(person))}</span>
      <span className="visually-hidden">{personName(person)} is writing</span>
    </span>
  );
}
