/** Which robots have an action, and how what they have differs. */
import type { ReactNode } from "react";
import type { LibraryAction } from "../../api/documents/library";
import {
  type RobotAction,
  type RobotsKnowledge,
  robotDifferences,
} from "../../library/robot-actions";
import { colorOfName } from "../../ui/name-colors";
import style from "./details.module.css";

interface Props {
  name: string;
  knowledge: RobotsKnowledge;
  /** What the library says; null: nothing. */
  own: Pick<LibraryAction, "inputs" | "outputs"> | null;
  /** What can be done with what a robot has. */
  offer?: (has: RobotAction) => ReactNode;
}

function words(has: RobotAction | undefined, unknown: boolean, own: Props["own"]) {
  if (has === undefined) {
    return { differs: false, text: unknown ? "does not say what it has" : "does not have it" };
  }
  const found = own === null ? [] : robotDifferences(own, has.action);
  return found.length === 0
    ? { differs: false, text: "has it" }
    : { differs: true, text: `has another: ${found.join(", ")}` };
}

export function OnRobots({ name, knowledge, own, offer }: Props) {
  const { robots, unknown, byName } = knowledge;
  const having = byName.get(name) ?? [];
  return (
    <section>
      <h3 className={style.heading}>On robots</h3>
      {robots.length === 0 && <p className={style.quiet}>No robot is registered.</p>}
      <ul className={style.facts} aria-label="Robots">
        {robots.map((robot) => {
          const has = having.find((each) => each.robot === robot);
          const { differs, text } = words(has, unknown.includes(robot), own);
          return (
            <li key={robot}>
              <span className={style.robot}>
                <i style={{ background: colorOfName(robot) }} aria-hidden /> <bdi>{robot}</bdi>
              </span>
              <span className={differs ? style.differs : style.quiet}>{text}</span>
              {has && offer?.(has)}
            </li>
          );
        })}
      </ul>
    </section>
  );
}
