/** Shows an action to read: its description, parameters and outputs, the graphs that use it, and the robots that have it. */

import { Button } from "@mantine/core";
import type { ReactNode } from "react";
import { Link } from "wouter";
import { useGraphNames } from "../api/graph-names";
import type { LibraryAction } from "../api/library";
import type { Parameter } from "../graph/model";
import { type RobotAction, type RobotsKnowledge, robotDifferences } from "../home/robot-actions";
import { colorOfName } from "../ui/name-colors";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./action-overview.module.css";
import { type ParameterFacts, parameterFacts } from "./parameter-facts";

function Row({ facts, free }: { facts: ParameterFacts; free: string }) {
  const { name, type, required, allowed, value, more } = facts;
  return (
    <tr>
      <th scope="row">{name}</th>
      <td>
        <code className={style.type}>{type}</code>
      </td>
      <td className={style.said}>
        {[allowed, ...more].filter(Boolean).join(" · ") || <span className="m-0 ink3">{free}</span>}
      </td>
      <td className={style.value}>
        {value !== null && <code>{value}</code>}{" "}
        {!required && <span className="m-0 ink3">optional</span>}
      </td>
    </tr>
  );
}

interface ParameterTableProps {
  title: string;
  /** Text shown without parameters. */
  none: string;
  parameters: readonly Parameter[];
  /** Text shown for a parameter without restrictions. */
  free?: string;
}

function ParameterTable({ title, none, parameters, free = "" }: ParameterTableProps) {
  const rows = parameterFacts(parameters);
  return (
    <section>
      <h3 className={style.heading}>{title}</h3>
      {rows.length === 0 ? (
        <p className="m-0 ink3">{none}</p>
      ) : (
        <table className={style.table} aria-label={title}>
          <thead>
            <tr>
              <th scope="col">name</th>
              <th scope="col">type</th>
              <th scope="col">allowed</th>
              <th scope="col" className={style.value}>
                value
              </th>
            </tr>
          </thead>
          <tbody>
            {rows.map((facts) => (
              <Row key={facts.path} facts={facts} free={free} />
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}

interface UsedInProps {
  usedIn: readonly string[];
  /** Graphs of `usedIn` in which the action has other parameters. */
  differs: readonly string[];
  /** Copies the parameters of a graph's action to the library; absent where that is not allowed. */
  onTake?: (graph: string, name: string) => void;
}

export function UsedIn({ usedIn, differs, onTake }: UsedInProps) {
  const graphs = useGraphNames().data ?? [];
  const nameOf = (id: string) => graphs.find((graph) => graph.id === id)?.name || "Untitled";
  return (
    <section>
      <h3 className={style.heading}>
        Used in
        {usedIn.length > 0 && <span>{counted(usedIn.length, "graph")}</span>}
      </h3>
      {usedIn.length === 0 && <p className="m-0 ink3">No graph uses it yet.</p>}
      <ul className={style.facts} aria-label="Graphs that use it">
        {usedIn.map((id) => (
          <li key={id}>
            <Link to={`/graphs/${id}`} className={style.link}>
              <bdi>{nameOf(id)}</bdi>
            </Link>
            {differs.includes(id) && (
              <span className="ink-warn weight-550">
                older parameters
                {onTake && (
                  <Button size="compact-sm" variant="subtle" onClick={() => onTake(id, nameOf(id))}>
                    Take over
                    <span className="visually-hidden"> what {isolated(nameOf(id))} has</span>
                  </Button>
                )}
              </span>
            )}
          </li>
        ))}
      </ul>
    </section>
  );
}

interface OnRobotsProps {
  name: string;
  knowledge: RobotsKnowledge;
  /** The action in the library; null if it is not there. */
  own: Pick<LibraryAction, "inputs" | "outputs"> | null;
  /** Returns the button for a robot that has the action. */
  offer?: (has: RobotAction) => ReactNode;
}

function words(has: RobotAction | undefined, unknown: boolean, own: OnRobotsProps["own"]) {
  if (has === undefined) {
    return { differs: false, text: unknown ? "does not say what it has" : "does not have it" };
  }
  const found = own === null ? [] : robotDifferences(own, has.action);
  return found.length === 0
    ? { differs: false, text: "has it" }
    : { differs: true, text: `has another: ${found.join(", ")}` };
}

export function OnRobots({ name, knowledge, own, offer }: OnRobotsProps) {
  const { robots, unknown, byName } = knowledge;
  const having = byName.get(name) ?? [];
  return (
    <section>
      <h3 className={style.heading}>On robots</h3>
      {robots.length === 0 && <p className="m-0 ink3">No robot is registered.</p>}
      <ul className={style.facts} aria-label="Robots">
        {robots.map((robot) => {
          const has = having.find((each) => each.robot === robot);
          const { differs, text } = words(has, unknown.includes(robot), own);
          return (
            <li key={robot}>
              <span className={style.robot}>
                <i style={{ background: colorOfName(robot) }} aria-hidden /> <bdi>{robot}</bdi>
              </span>
              <span className={differs ? "ink-warn weight-550" : "m-0 ink3"}>{text}</span>
              {has && offer?.(has)}
            </li>
          );
        })}
      </ul>
    </section>
  );
}

interface Props {
  description: string;
  type: string;
  labels: readonly string[];
  inputs: readonly Parameter[];
  outputs: readonly Parameter[];
  /** Sections about the graphs that use it and the robots that have it. */
  children: ReactNode;
}

const TYPES: Readonly<Record<string, string>> = {
  sync: "runs until it is done",
  async: "runs until it is done",
  spontaneous: "may report again and again",
};

export function ActionOverview({ description, type, labels, inputs, outputs, children }: Props) {
  return (
    <>
      <p className={style.lead}>{description || "No description yet."}</p>
      <ul className={style.marks} aria-label="Type and labels">
        <li title={`Type ${type}`}>{TYPES[type] ?? `type ${type}`}</li>
        {labels.map((label) => (
          <li key={label}>{label}</li>
        ))}
      </ul>
      <ParameterTable title="Takes" none="No parameters." free="anything" parameters={inputs} />
      <ParameterTable title="Gives" none="Nothing but its outcome." parameters={outputs} />
      <div className={style.pair}>{children}</div>
    </>
  );
}
