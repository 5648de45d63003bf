/** Shows the other people: faces in the bar, the one being followed, and who is at which card. */
import { ViewportPortal } from "@xyflow/react";
import type { CSSProperties } from "react";
import { checkedColor } from "../api/people";
import { CARD, type Positions, type Sizes } from "../canvas/geometry/ranks";
import { splitKey } from "../graph/document-keys";
import type { Participant } from "../sync/presence/presence";
import { useColorsAfterReturn, useFollowing, usePeople } from "../sync/use-room";
import { initials } from "../ui/name-colors";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import style from "./people.module.css";

const MOST = 4;

function personName(person: { readonly name: string }): string {
  return person.name || "Guest";
}

/** A name as it is written, whatever its direction does to what stands beside it. */
export function Name({ of }: { of: { readonly name: string } }) {
  return <bdi className={style.name}>{personName(of)}</bdi>;
}

/** Returns each person once, however many windows they have. */
export function onePerId<T extends { readonly id: string }>(people: readonly T[]): T[] {
  return [...new Map(people.map((person) => [person.id, person])).values()];
}

export const colored = (color: string | undefined) => ({ "--c": color }) as CSSProperties;

export function People({ me }: { me: string }) {
  useColorsAfterReturn();
  const { whom, follow } = useFollowing();
  const people = usePeople().filter((person) => person.id !== me);
  const leader = people.find(({ client }) => client === whom);
  const others = onePerId(leader ? [...people, leader] : people);
  if (others.length === 0) return null;
  const shown = others.slice(0, MOST);
  const names = others.map((each) => isolated(personName(each))).join(", ");
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
              style={colored(checkedColor(person.color))}
              aria-pressed={followed}
              aria-label={`Follow ${isolated(personName(person))}`}
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

/** Frames the canvas while it follows the view of somebody else, with their name and a button that ends it. */
export function FollowFrame() {
  useColorsAfterReturn();
  const { whom, follow } = useFollowing();
  const people = usePeople();
  const leader = people.find(({ client }) => client === whom);
  if (leader === undefined) return null;
  return (
    <div className={style.frame} style={colored(checkedColor(leader.color))}>
      <span className={`${style.followed} fingers`} role="status">
        Following <Name of={leader} />
        <button type="button" onClick={() => follow(null)}>
          Stop following<kbd aria-hidden>Esc</kbd>
        </button>
      </span>
    </div>
  );
}

interface AtCardsProps {
  me: string;
  places: Positions;
  sizes: Sizes;
  /** The folded frames that are drawn instead of what lies in them. */
  blockOf?: ReadonlyMap<string, string> | undefined;
}

/** Small initials at the cards of which somebody has a field under their caret. */
export function PeopleAtCards({ me, places, sizes, blockOf }: AtCardsProps) {
  const people = usePeople();
  const at = new Map<string, Participant[]>();
  for (const person of people) {
    const action = splitKey(person.presence.editing ?? "").head;
    const head = blockOf?.get(action) ?? action;
    if (person.id !== me && places.has(head)) at.set(head, [...(at.get(head) ?? []), person]);
  }
  if (at.size === 0) return null;
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
              <PersonSign key={person.id} person={person} color={checkedColor(person.color)} />
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
      title={`${isolated(personName(person))} is writing`}
    >
      <span aria-hidden>{initials(personName(person))}</span>
      <span className="visually-hidden">{isolated(personName(person))} is writing</span>
    </span>
  );
}
